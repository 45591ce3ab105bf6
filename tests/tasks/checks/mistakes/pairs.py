"""Mistakes of newcomers in whole files, each beside what was meant: told, mended, what was meant given back.

A file is written once, with `[[wrong~>right]]` wherever the two differ. As a program:
`python -m tests.tasks.checks.mistakes.pairs [--missed] [--other] [NAME...]`, NAME one of `SETS`.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

from tests.tasks.checks.mistakes.counted import Account, account_of, show, table
from tests.tasks.checks.mistakes.mutations import Slip

FOLDER = Path(__file__).parent / "newcomers"
SETS = ("fifteenth", "sixteenth", "seventeenth", "eighteenth", "nineteenth")
_PAIR = re.compile(r"\[\[(.*?)~>(.*?)\]\](?!\])", re.DOTALL)
_BETWEEN = re.compile(r"^====\n", re.MULTILINE)


def pairs(name: str, of_task: bool) -> Iterator[Slip]:
    """The files of a set in one of the two languages, with their mistakes."""
    file = FOLDER / f"{name}_{'tasks' if of_task else 'rules'}.txt"
    for written in _BETWEEN.split(file.read_text(encoding="utf-8")):
        yield Slip(name, _PAIR.sub(r"\2", written), _PAIR.sub(r"\1", written), 0)


def accounts(name: str) -> Iterator[tuple[bool, Slip, Account | None]]:
    """What becomes of each mistake of a set; None of those that are legal."""
    for of_task in (False, True):
        for slip in pairs(name, of_task):
            yield of_task, slip, account_of(slip, of_task)


def main() -> None:
    """Count, and show what is missed, or mended to something else than what was meant."""
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*", default=SETS)
    parser.add_argument("--missed", action="store_true")
    parser.add_argument("--other", action="store_true")
    options = parser.parse_args()
    found = [one for name in options.names for one in accounts(name)]
    for of_task, slip, one in found:
        if one is None:
            print("===== legal", slip.text, sep="\n")
        elif (options.missed and not (one.told and one.legal)) or (
            options.other and one.legal and not one.restored
        ):
            show(of_task, one)
    print(table([(of_task, one) for of_task, _, one in found if one is not None]))


if __name__ == "__main__":
    main()
