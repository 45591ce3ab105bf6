"""Attacks that were thought of, rather than drawn: each is a folder, a command, and how it must end.

The command is run as it is typed, in a process of its own that has its libraries loaded, under the bounds of
`fuzzing.py`. Beyond these a command must end with the right exit code, and must not print a traceback, nor
anything that a terminal obeys; nothing in the folder may have run, and no draft may be left in it.
"""

from __future__ import annotations

import os
import random
import re
import shlex
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.oracles.hardening.fuzzing import Findings, fuzz
from tests.oracles.hardening.subjects import Subject
from visup.cli import main

RAN = "it ran"
"""The name of a file that code of an attack leaves behind where it must not run."""
KEPT = "precious"
"""The name of a file beside the folder, with its own name in it, that no command may change."""

OBEYED = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


@dataclass(frozen=True, slots=True)
class Attack:
    """An attack.

    Attributes:
        command: Words of the command, run in the folder of the attack.
        codes: Exit codes that are right.
        make: Puts into an empty folder what the command meets there.
        says: A word that must be in what is printed.
    """

    command: str
    codes: tuple[int, ...]
    make: Callable[[Path], object]
    says: str = ""


class WrongEndError(Exception):
    """A command did not end as it must."""


def attacked(attacks: Mapping[str, Attack], place: Path) -> Findings:
    """What came of attacks, by name."""
    found = Findings()
    for name, attack in attacks.items():
        one = fuzz(_subject(attack), 1, 0, place)
        found.outcomes += one.outcomes
        found.failures += [failure.replace("0:", f"'{name}':", 1) for failure in one.failures]
    return found


def _subject(attack: Attack) -> Subject:
    def make(folder: Path, rng: random.Random) -> None:
        (folder.parent / KEPT).write_text(KEPT)
        attack.make(folder)

    return Subject(make, lambda folder: run_attack(attack, folder))


def run_attack(attack: Attack, folder: Path) -> None:
    """Run the command of an attack whose files have been made.

    Raises:
        WrongEndError: It did not end as it must.
    """
    os.chdir(folder)
    said_at = folder.parent / "said"
    code = _called(shlex.split(attack.command), said_at)
    said = said_at.read_text(errors="replace")
    wrong = [
        (code not in attack.codes, f"exit code {code}, not {attack.codes}"),
        ("Traceback (most recent" in said, "a traceback"),
        (OBEYED.search(said) is not None, "something that a terminal obeys"),
        (attack.says not in said, f"nothing of '{attack.says}'"),
        ((folder / RAN).exists(), "code of the folder ran"),
        (any(folder.rglob("*.part")), "a draft was left"),
        ((folder.parent / KEPT).read_text() != KEPT, "a file elsewhere was changed"),
    ]
    told = [what for holds, what in wrong if holds]
    if told:
        raise WrongEndError(f"{', '.join(told)}: {said[-300:]}")


def _called(words: list[str], said: Path) -> int:
    """The exit code of `visup` with words; what it prints goes to a file."""
    out = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream in (1, 2):
        os.dup2(out, stream)
    sys.argv = ["visup", *words]
    try:
        main()
    except SystemExit as end:
        return int(end.code or 0)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
    return 0
