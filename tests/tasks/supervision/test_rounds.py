"""`for each new part <take(part)>`: a loop with another part each time round.

The dumb twin of such a loop is the same loop written out, with an actor for each part that is known by
name from the start: what is believed of the loop must be what is believed of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tasks.scripted import RelationSpan, Script, ScriptedRun, mind_at, play, task_of
from visup.agent import Event, Observation, Status, Verdict
from visup.agent.storage.checkpoint import dump_state, load_state
from visup.tasks import parse_task
from visup.tasks.supervision.supervise import finish, task_reasoner

ARM, BIN, FIRST = 1, 2, 3
PARTS = 3
EVERY_S = 7.0
LOOP = """<empty> ::= <reach> {loop} <leave>
<reach> ::= touching(arm, bin)
<take(part)> ::= coupled(arm, part) apart(part, bin) decoupled(arm, part)
<leave> ::= apart(arm, bin) for 2 s
"""


def loop(times: str = "") -> str:
    return LOOP.format(loop=f"for each new part <take(part)>{times}")


def written_out(order: Sequence[int]) -> str:
    return LOOP.format(loop=" ".join(f"<take(part_{k})>" for k in order))


def emptied(order: Sequence[int], *, alike: bool = True, leaves: bool = True) -> Script:
    """A bin out of which parts are taken in an order, each for 4 s; one taken again was put back."""
    spans = []
    for part in range(PARTS):
        back = 0.0
        for taken in (2.0 + EVERY_S * k for k, p in enumerate(order) if p == part):
            spans.append(RelationSpan("touching", back, taken + 1.5, (BIN, FIRST + part)))
            spans.append(RelationSpan("touching", taken, taken + 4.5, (ARM, FIRST + part)))
            spans.append(RelationSpan("coupled", taken + 0.5, taken + 4.5, (ARM, FIRST + part)))
            back = taken + 5.5
        if part not in order:
            spans.append(RelationSpan("touching", 0.0, 1e9, (BIN, FIRST + part)))
    end = 2.0 + EVERY_S * len(order)
    spans.append(RelationSpan("touching", 0.5, end if leaves else 1e9, (ARM, BIN)))
    names = {FIRST + k: {"part" if alike else f"part_{k}": 0.9} for k in range(PARTS)}
    names |= {ARM: {"arm": 0.9}, BIN: {"bin": 0.9}}
    return Script(tuple(spans), objects=dict.fromkeys(names, (0.0, 1000000000.0)), identities=names)


def watched(text: str, script: Script, rounds: int) -> ScriptedRun:
    until = 2.0 + EVERY_S * rounds + 6.0
    return play(task_reasoner([parse_task(text)]), script, until, fps=4.0)


def verdict(played: ScriptedRun) -> Verdict:
    return finish(task_of(played))


def done(played: ScriptedRun) -> list[int]:
    """The parts whose rounds were told complete, by what their objects are."""
    completed = [e for e in played.events if e.kind == "stage_done" and "take" in e.data["stage"]]
    bindings = {b.actor: b.object_id for b in task_of(played).bindings}
    return [(bindings[e.data["stage"][5:-1]] or 0) - FIRST for e in completed]


orders = st.permutations(range(PARTS)).flatmap(
    lambda p: st.integers(1, PARTS).map(lambda n: tuple(p[:n]))
)


@settings(max_examples=3)
@given(orders, st.booleans())
def test_a_loop_is_equivalent_to_the_loop_written_out(order: tuple[int, ...], leaves: bool) -> None:
    looped = watched(loop(), emptied(order, leaves=leaves), len(order))
    distinct = emptied(order, alike=False, leaves=leaves)
    unrolled = watched(written_out(order), distinct, len(order))
    assert verdict(looped) is verdict(unrolled)
    assert done(looped) == list(order)
    assert [e.kind for e in looped.events] == [e.kind for e in unrolled.events]


@pytest.mark.parametrize(
    ("order", "times", "expected"),
    [
        ((1,), " at least 2 times", False),
        ((1, 0), " at least 2 times", True),
        ((1, 1), " at least 2 times", False),
    ],
)
def test_each_part_counts_as_one_round(order: tuple[int, ...], times: str, expected: bool) -> None:
    played = watched(loop(times), emptied(order), len(order))
    assert (verdict(played) is Verdict.SUCCEEDED) is expected


def test_a_part_that_enters_later_has_the_next_round() -> None:
    script = emptied((0, 2))
    late = {**script.objects, FIRST: (0.0, 8.5), FIRST + 2: (8.6, 1e9)}
    few = {k: v for k, v in late.items() if k not in (FIRST + 1,)}
    played = watched(loop(" at least 2 times"), replace(script, objects=few), 2)
    assert verdict(played) is Verdict.SUCCEEDED
    assert done(played)[-1] == 2


def test_missing_parts_of_a_loop_are_not_waited_for() -> None:
    initial = task_of(watched(loop(), emptied(()), 0))
    assert {s.status for s in initial.stages if s.stage == "take(part_9)"} == {Status.PENDING}
    nobody = task_of(watched(loop(), replace(emptied(()), identities={}), 0))
    assert nobody.evidence == "not found yet: arm, bin, part"


def test_future_rounds_without_parts_are_one_prospect() -> None:
    present = {k: v for k, v in emptied((0,)).objects.items() if k <= FIRST}
    next_ones = task_of(watched(loop(), replace(emptied(()), objects=present), 0)).prospects
    rounds = [p.stage for p in next_ones if p.stage.startswith("take")]
    assert rounds == ["take(part_2)"]


def test_a_run_resumed_within_a_round_continues_unchanged() -> None:
    script, whole = emptied((1, 0)), watched(loop(), emptied((1, 0)), 2)
    reasoner = task_reasoner([parse_task(loop())])
    resumed_at = next(i for i, m in enumerate(whole.minds) if m.time >= 4.0)
    mind, events = load_state(dump_state(whole.minds[resumed_at])), list[Event]()
    for index in range(resumed_at + 1, len(whole.minds)):
        now = mind_at(script, index / 4.0, index, mind)
        outcome = reasoner(now, Observation(index, index / 4.0, (640, 480)))
        mind, events = outcome.mind, [*events, *outcome.events]
    assert events == [e for e in whole.events if e.time > 4.0]


def repeated(
    text: str, touches: Sequence[tuple[float, float]], last_s: float | None
) -> ScriptedRun:
    """A task about contacts `<a>` between arm and bin, and `<c>` between arm and part."""
    spans = [RelationSpan("touching", *touch, (ARM, BIN)) for touch in touches]
    if last_s is not None:
        spans.append(RelationSpan("touching", last_s, 1e9, (ARM, FIRST)))
    names = {ARM: {"arm": 0.9}, BIN: {"bin": 0.9}, FIRST: {"part": 0.9}}
    present = dict.fromkeys(names, (0.0, 1e9))
    stages = "\n<a> ::= touching(arm, bin)\n<b> ::= apart(arm, bin)\n<c> ::= touching(arm, part)"
    used = "\n".join(x for x in stages.splitlines() if x[:3] in text)
    script = Script(tuple(spans), objects=present, identities=names)
    return play(task_reasoner([parse_task(f"<t> ::= {text}\n{used}")]), script, 24.0)


@pytest.mark.parametrize(
    ("times", "required"),
    [
        ("<a> at least 2 times", 2),
        ("<a> at least 3 times", 3),
        ("<a> at least 2 times at most 3 times", 2),
        ("<a> at most 3 times", 1),
        ("<a>+", 1),
        ("(<a> <b>) at least 2 times", 2),
    ],
)
@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_missing_round_prevents_success(times: str, required: int, count: int) -> None:
    touches = [(2.0 + 4.0 * k, 4.0 + 4.0 * k) for k in range(count)]
    played = repeated(f"{times} <c>", touches, 2.0 + 4.0 * count)
    assert (verdict(played) is Verdict.SUCCEEDED) is (count >= required)


@pytest.mark.parametrize("clause", ["", " for 2 s"])
def test_a_continuing_action_is_one_round(clause: str) -> None:
    text = f"<a>{clause} at least 2 times <c>"
    assert verdict(repeated(text, [(2.0, 12.0)], 14.0)) is not Verdict.SUCCEEDED
    assert verdict(repeated(text, [(2.0, 6.0), (8.0, 12.0)], 14.0)) is Verdict.SUCCEEDED


@pytest.mark.parametrize(("text", "required"), [("<a>+", 1), ("<a> at least 2 times", 2)])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_task_that_ends_with_a_loop_succeeds_once(text: str, required: int, count: int) -> None:
    played = repeated(text, [(2.0 + 4.0 * k, 4.0 + 4.0 * k) for k in range(count)], None)
    verdicts = [e for e in played.events if e.kind == "verdict"]
    assert [e.data["verdict"] for e in verdicts] == ["succeeded"] * (count >= required)


def test_a_missing_turn_of_an_actor_prevents_success() -> None:
    text = "<t> ::= for each thing of (bin, part) <meet(thing)> <leave>\n"
    text += "<meet(thing)> ::= touching(arm, thing)\n<leave> ::= apart(arm, bin) for 2 s"
    names = {ARM: {"arm": 0.9}, BIN: {"bin": 0.9}, FIRST: {"part": 0.9}}
    spans = [
        RelationSpan("touching", 2.0, 4.0, (ARM, FIRST)),
        RelationSpan("touching", 6.0, 8.0, (ARM, BIN)),
    ]
    for count, expected in ((1, False), (2, True)):
        present = dict.fromkeys(names, (0.0, 1e9))
        script = Script(tuple(spans[:count]), objects=present, identities=names)
        played = play(task_reasoner([parse_task(text)]), script, 20.0)
        assert (verdict(played) is Verdict.SUCCEEDED) is expected
