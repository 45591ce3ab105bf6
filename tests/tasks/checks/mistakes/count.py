"""How many of the deliberate mistakes of later sittings are mended by their hints; as a program, of all."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from tests.rules.language.test_mistakes import rule
from tests.tasks.checks.mistakes import (
    eighth_conditions,
    eighth_tasks,
    eleventh,
    fourteenth,
    ninth_conditions,
    ninth_tasks,
    tenth,
    thirteenth,
    twelfth,
)
from tests.tasks.checks.test_mistakes_counted import fixed, rule_messages, task_messages

BOTH = (tenth, eleventh, twelfth, thirteenth, fourteenth)
"""Sittings whose mistakes in both languages stand in one table."""


def in_task(stage: str) -> str:
    """A stage with a mistake, in a task that needs it."""
    return f"<t> ::= <a> <b>\n{stage}\n<b> ::= coupled(x, y)"


def mistakes() -> Iterator[tuple[str, Callable[[], bool]]]:
    """Each text with a mistake, and whether its hints mend it."""
    for table in (eighth_conditions, ninth_conditions, *BOTH):
        for text in (*map(rule, table.CONDITIONS), *table.WHOLE_RULES):
            yield text, partial(fixed, text, rule_messages)
    for tasks in (eighth_tasks, ninth_tasks, *BOTH):
        for text in (*map(in_task, tasks.STAGES), *tasks.FILES):
            yield text, partial(fixed, text, task_messages)


if __name__ == "__main__":
    every = list(mistakes())
    missed = [text for text, is_mended in every if not is_mended()]
    print(*missed, f"{len(every) - len(missed)} of {len(every)}", sep="\n\n")
