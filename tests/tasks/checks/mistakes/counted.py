"""Mechanical mistakes in all good texts of the repository, counted: told, mended, what was meant given back.

As a program: `python -m tests.tasks.checks.mistakes.counted [--of-each N] [--seed N] [--every N] [--missed]`.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from random import Random
from typing import Any

from tests.rules.language.test_mistakes import rule
from tests.tasks.checks.mistakes import good_texts
from tests.tasks.checks.mistakes.mutations import Mutation, mutations
from tests.tasks.checks.test_mistakes_counted import fixes, rule_messages, task_messages
from visup.rules.language.parser import parse_rules
from visup.tasks.checks.diagnose import diagnose

ROOT = Path(__file__).parents[4]
MAX_FIXES = 6
LONGEST = 1500
"""Characters of a good text; longer ones take long and hold the same sentences."""
_BLOCK = re.compile(r"^```\w*\n(.*?)^```", re.MULTILINE | re.DOTALL)
_RULE = re.compile(r"^(?=rule\b)", re.MULTILINE)


def good_rules() -> list[str]:
    """Each rule of the pages and of the file that ships."""
    shipped = (ROOT / "rules/safety/safety.rules").read_text(encoding="utf-8")
    texts = [shipped, *_blocks("docs/*.md")]
    found = [r for text in texts for r in _RULE.split(text)[1:]]
    found += [*map(rule, good_texts.CONDITIONS), *good_texts.RULES]
    return [r for r in dict.fromkeys(f"{_bare(r)}\n" for r in found) if not rule_messages(r)]


def good_tasks() -> list[str]:
    """Each task file of the pages, the examples, the tests and those that ship."""
    files = [*ROOT.glob("tests/tasks/good/*.task"), *ROOT.glob("tasks/shipped/*.task")]
    texts = [f.read_text(encoding="utf-8") for f in sorted(files)]
    texts += [*_blocks("docs/*.md"), *_blocks("examples/tasks/*.md"), *good_texts.TASKS]
    some = [t for t in dict.fromkeys(texts) if "::=" in t and len(t) < LONGEST]
    return [t for t in some if not task_messages(t)]


def _blocks(pattern: str) -> list[str]:
    pages = [p.read_text(encoding="utf-8") for p in sorted(ROOT.glob(pattern))]
    return [block for page in pages for block in _BLOCK.findall(page)]


def _bare(rule: str) -> str:
    return "\n".join(row for row in rule.split("\n") if not row.startswith("#")).rstrip()


@dataclass(frozen=True)
class HintOutcome:
    """What became of one mistake.

    Attributes:
        mutation: The mistake.
        complete: Whether each message has its place, and says what was expected or what to do.
        legal: Whether taking up the hints leads to a legal text.
        restored: Whether that text says what the good one said.
        fixed_text: The text to which the hints lead.
    """

    mutation: Mutation
    complete: bool
    legal: bool
    restored: bool
    fixed_text: str


def outcome_of(mutation: Mutation, of_task: bool) -> HintOutcome | None:
    """What becomes of a mistake; None if the text is legal all the same."""
    read = task_messages if of_task else rule_messages
    found = read(mutation.text)
    if not found:
        return None
    complete = all("^" in t.text and (t.expected or t.hint) for t in found)
    text = mutation.text
    for _ in range(MAX_FIXES):
        fix = next(fixes(text, found), None)
        if fix is None:
            break
        text = fix.applied(text)
        found = read(text)
        if not found:
            break
    legal = not found
    restored = legal and meaning(text, of_task) == meaning(mutation.good, of_task)
    return HintOutcome(mutation, bool(complete), legal, restored, text)


@lru_cache(maxsize=4096)
def meaning(text: str, of_task: bool) -> Any:
    """The tree of a legal text."""
    return diagnose(text, "my.task")[0] if of_task else parse_rules(text, "my.rules")


def accounts(of_each: int, seed: int, every: int) -> Iterator[tuple[bool, HintOutcome]]:
    """The accounts of the mistakes made from each `every`th good text."""
    chance = Random(seed)
    for of_task, texts in ((False, good_rules()), (True, good_tasks())):
        for good in texts[seed % every :: every]:
            for mutation in mutations(good, chance, of_each):
                found = outcome_of(mutation, of_task)
                if found is not None:
                    yield of_task, found


def table(found: Sequence[tuple[bool, HintOutcome]]) -> str:
    """Counts by language and kind: mistakes, told, mended, what was meant."""
    rows: dict[tuple[bool, str], Counter[str]] = {}
    for of_task, one in found:
        for kind in (one.mutation.kind, "all"):
            row = rows.setdefault((of_task, kind), Counter())
            row.update(
                n=1, complete=one.complete, legal=one.complete and one.legal, same=one.restored
            )
    lines = [f"{'':24}{'mistakes':>9}{'told':>7}{'mended':>8}{'as meant':>10}"]
    for (of_task, kind), row in sorted(rows.items()):
        name = f"{'tasks' if of_task else 'rules'}: {kind}"
        share = f"{100 * row['legal'] / row['n']:.0f} %"
        lines.append(
            f"{name:24}{row['n']:9}{row['told']:7}{row['legal']:8}{row['same']:10}  {share}"
        )
    return "\n".join(lines)


def main() -> None:
    """Count, and show what is missed of one kind."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--of-each", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--missed", action="store_true")
    parser.add_argument("--other", action="store_true")
    options = parser.parse_args()
    found = list(accounts(options.of_each, options.seed, options.every))
    for of_task, one in found:
        missed = options.missed and not (one.complete and one.legal)
        if missed or (options.other and one.legal and not one.restored):
            print_outcome(of_task, one)
    print(table(found))


def print_outcome(of_task: bool, one: HintOutcome) -> None:
    """Print the lines that a mistake and its hints have changed, and what was said of it."""
    told = task_messages(one.mutation.text) if of_task else rule_messages(one.mutation.text)
    print("=====", "task" if of_task else "rule", one.mutation.kind)
    before, after = one.mutation.good.split("\n"), one.fixed_text.split("\n")
    slipped = one.mutation.text.split("\n")
    for sign, rows, others in (("good ", before, slipped), ("wrong", slipped, before)):
        print(*(f"{sign} {row}" for row in rows if row not in others), sep="\n")
    print(*(f"fixed {row}" for row in after if row not in slipped), sep="\n")
    for fault in told[:3]:
        print("  ", fault.text.split("\n")[0], "| hint:", fault.hint)


if __name__ == "__main__":
    main()
