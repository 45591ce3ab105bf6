"""Parts that rest against each other count as one body; the order in which parts are assembled is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from random import Random

from tests.tasks.learning.test_learning import ARM, CRATE, PART, TRAY, run_of
from tests.tasks.scripted import RelationSpan
from visup.agent import Verdict
from visup.tasks import parse_task
from visup.tasks.analysis.judging import judged
from visup.tasks.learning.bodies import with_resting_bodies_merged
from visup.tasks.learning.induction import learn_task
from visup.tasks.learning.order import Disjunction
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.traces import ActionInterval, RunTrace

Events = list[CourseEvent]


def contact(one: str, other: str, begin: float, end: float = 20.0) -> CourseEvent:
    pair = tuple(sorted((one, other)))
    return CourseEvent(ActionInterval(("touching", pair), begin, end), begin, end == 20.0)


def trace(**moved_s: float) -> RunTrace:
    return RunTrace("run", (), 0.0, 20.0, moved_s=moved_s)


RUNS = [trace(base=0.0, block=3.0, cap=3.0)] * 2
FIRST = contact("base", "block", 4.0)


def merged(*rows: Sequence[CourseEvent]) -> list[Events]:
    return with_resting_bodies_merged(rows, RUNS[: len(rows)])


def test_two_contacts_merge_into_the_one_with_the_part_that_moves_less() -> None:
    rows = [
        [FIRST, contact("base", "cap", 8.0), contact("block", "cap", 8.1)],
        [FIRST, contact("block", "cap", 8.0, 9.0), contact("base", "cap", 8.4)],
    ]
    for row in merged(*rows):
        assert [e.item for e in row] == [FIRST.symbol, ("touching", ("base", "cap"))]


def test_either_contact_is_evidence_if_each_is_missing_in_some_run() -> None:
    first, second = merged(
        [FIRST, contact("base", "cap", 8.0)], [FIRST, contact("block", "cap", 9.0)]
    )
    either = Disjunction((("touching", ("base", "cap")), ("touching", ("block", "cap"))))
    assert [e.item for e in first] == [e.item for e in second] == [FIRST.symbol, either]
    assert (first[1].at, second[1].at) == (8.0, 9.0)


def test_contacts_are_not_merged_if_the_two_parts_separate() -> None:
    first = contact("base", "block", 4.0, 6.0)
    row = [first, contact("base", "cap", 8.0), contact("block", "cap", 9.0)]
    assert merged(row) == [row]


def test_an_incidental_contact_before_the_two_parts_meet_is_dropped() -> None:
    passing, long = contact("block", "cap", 3.6, 4.2), contact("block", "cap", 2.0, 3.6)
    kept = [FIRST, contact("base", "cap", 8.0)]
    assert merged([passing, *kept]) == [kept]
    assert merged([long, *kept]) == [[long, *kept]]


def assembly_run(name: str, seed: int, order: Sequence[int] = (PART, CRATE)) -> RunTrace:
    """Part and crate are put onto the tray, one after the other."""
    rng, at, spans = Random(seed), 1.0, list[RelationSpan]()
    for thing in order:
        arrives = at + rng.uniform(3.0, 5.0)
        spans += [
            RelationSpan("converging", at, arrives, (thing, TRAY)),
            RelationSpan("touching", arrives, 1e9, (thing, TRAY)),
        ]
        at = arrives + rng.uniform(3.0, 4.0)
    spans.append(RelationSpan("touching", at - 3.0, 1e9, (PART, CRATE)))
    spans.append(RelationSpan("converging", 0.4, 2.0, (ARM, PART)))
    return replace(run_of(name, spans), moved_s={"crate": 3.0, "part": 3.0, "tray": 0.0})


def test_the_order_of_assembly_is_learned() -> None:
    learned = learn_task("assemble", [assembly_run(f"good{k}", k) for k in range(3)])
    task = parse_task(learned.text)
    assert (
        "never (touching(crate, tray) and not touching(part, tray)) for 2 s during" in learned.text
    )
    assert judged(task, assembly_run("x", 10).minds).verdict is Verdict.SUCCEEDED
    assert judged(task, assembly_run("x", 11, (CRATE, PART)).minds).verdict is not Verdict.SUCCEEDED
