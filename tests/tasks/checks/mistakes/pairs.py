"""Mistakes of newcomers in whole files, each beside what was meant: told, mended, what was meant given back.

A file is written once, with `[[wrong~>right]]` wherever the two differ. As a program:
`python -m tests.tasks.checks.mistakes.pairs [--missed] [--other] [--beside] [NAME...]`, NAME one of `SETS`.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from tests.tasks.checks.mistakes.carets import points_at_culprit
from tests.tasks.checks.mistakes.counted import HintOutcome, outcome_of, print_outcome, table
from tests.tasks.checks.mistakes.mutations import Mutation
from tests.tasks.checks.test_mistakes_counted import Message, rule_messages, task_messages

FOLDER = Path(__file__).parent / "newcomers"
SETS = ("fifteenth", "sixteenth", "seventeenth", "eighteenth", "nineteenth", "twentieth")
_PAIR = re.compile(r"\[\[(.*?)~>(.*?)\]\](?!\])", re.DOTALL)
_BETWEEN = re.compile(r"^====\n", re.MULTILINE)


def pairs(name: str, of_task: bool) -> Iterator[Mutation]:
    """The files of a set in one of the two languages, with their mistakes."""
    file = FOLDER / f"{name}_{'tasks' if of_task else 'rules'}.txt"
    for written in _BETWEEN.split(file.read_text(encoding="utf-8")):
        yield Mutation(name, _PAIR.sub(r"\2", written), _PAIR.sub(r"\1", written), 0)


def accounts(name: str) -> Iterator[tuple[bool, Mutation, HintOutcome | None]]:
    """What becomes of each mistake of a set; None of those that are legal."""
    for of_task in (False, True):
        for mutation in pairs(name, of_task):
            yield of_task, mutation, outcome_of(mutation, of_task)


class Pointing(NamedTuple):
    """What the messages of a mistake point at.

    Attributes:
        of_task: Whether it is one of a task file.
        mutation: The mistake.
        complete: Its messages.
        any: Whether one of them points at the culprit.
        first: Whether the first of them does.
    """

    of_task: bool
    mutation: Mutation
    complete: list[Message]
    any: bool
    first: bool


def pointings(name: str) -> Iterator[Pointing]:
    """What the messages of each mistake of a set point at; nothing for those that are legal."""
    for of_task in (False, True):
        for mutation in pairs(name, of_task):
            told = task_messages(mutation.text) if of_task else rule_messages(mutation.text)
            if told:
                at = [points_at_culprit(t.place, mutation.text, mutation.good) for t in told]
                yield Pointing(of_task, mutation, told, any(at), at[0])


def carets(names: Sequence[str], show_beside: bool) -> str:
    """How many mistakes are pointed at, by set and in all; those that are not are printed if wanted."""
    found = [one for name in names for one in pointings(name)]
    for one in (one for one in found if show_beside and not one.any):
        print("===== beside the culprit", one.mutation.kind, "meant:", one.mutation.good, sep="\n")
        print(*(told.text for told in one.complete), sep="\n")
    lines = [f"{'':24}{'mistakes':>9}{'caret':>7}{'caret of the first message':>28}"]
    for name in (*names, "all"):
        some = [one for one in found if name in (one.mutation.kind, "all")]
        at, first = sum(one.any for one in some), sum(one.first for one in some)
        lines.append(f"{name:24}{len(some):9}{at:7}{first:28}  {100 * at / len(some):.0f} %")
    return "\n".join(lines)


def main() -> None:
    """Count, and show what is missed, or mended to something else than what was meant."""
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*", default=SETS)
    parser.add_argument("--missed", action="store_true")
    parser.add_argument("--other", action="store_true")
    parser.add_argument("--beside", action="store_true")
    options = parser.parse_args()
    found = [one for name in options.names for one in accounts(name)]
    for of_task, mutation, one in found:
        if one is None:
            print("===== legal", mutation.text, sep="\n")
        elif (options.missed and not (one.complete and one.legal)) or (
            options.other and one.legal and not one.restored
        ):
            print_outcome(of_task, one)
    print(table([(of_task, one) for of_task, _, one in found if one is not None]))
    print(carets(options.names, options.beside))


if __name__ == "__main__":
    main()
