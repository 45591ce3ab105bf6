"""Ground truth of a pick, and the task files that users write for one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from visup.render.worlds.kinds.kind import stage_spans
from visup.render.worlds.world import Contact, Motion, StageSpan, TaskTruth

if TYPE_CHECKING:
    from visup.render.worlds.kinds.pick import PickTimes

PICK_AND_PLACE_TASK = """\
# pick_and_place.task: a gripper takes a part to a fixture.
<pick_and_place> ::= <reach> <grasp> <carry> <place> <withdraw>

<reach>          ::= converging(gripper, part)
<grasp>          ::= coupled(gripper, part)
<carry>          ::= moving_together(gripper, part) & converging(part, fixture)
<place>          ::= touching(part, fixture) & coupled(gripper, part)
<withdraw>       ::= decoupled(gripper, part) diverging(gripper, part)
"""

PLACE_STAGES = """\
<reach>   ::= converging(gripper, part)
<grasp>   ::= coupled(gripper, part)

# From here on the part goes where the gripper goes. Dropping it is the failure; a detour is none.
<lift>    ::= moving_together(gripper, part) & moving(part)
              fails when apart(gripper, part)
<carry>   ::= moving_together(gripper, part) & converging(part, fixture)
              fails when apart(gripper, part)
<place>   ::= touching(part, fixture) & coupled(gripper, part)
<release> ::= decoupled(gripper, part) & touching(part, fixture)
<retreat> ::= diverging(gripper, part) for 0.3 s
"""

PLACE_TASK = (
    "# place.task: a gripper picks a part up, puts it on or in a fixture, lets it go and draws back.\n"
    "<put>     ::= <reach> <grasp> <lift> <carry> <place> <release> <retreat>\n\n" + PLACE_STAGES
)

PLACE_AGAIN_TASK = (
    "# place_again.task: as place.task, but a try that comes to nothing may be followed by another.\n"
    "<put>     ::= <reach> (<grasp> <lift> <carry> <place> <release> <retreat> | <slip> <put>)\n\n"
    "<slip>    ::= diverging(gripper, part)\n" + PLACE_STAGES
)


def truth_and_task(
    rng: np.random.Generator, times: PickTimes, outcome: str, drop_s: float
) -> tuple[TaskTruth, str, str]:
    """Ground truth, and the name and text of the task file."""
    if outcome == "retry":
        name, text = "place_again", PLACE_AGAIN_TASK
    elif rng.random() < 0.5:
        name, text = "place", PLACE_TASK
    else:
        name, text = "pick_and_place", PICK_AND_PLACE_TASK
    stages = _stages(times, outcome, drop_s, short=name == "pick_and_place")
    verdict = "succeeded" if outcome in ("ok", "retry", "in_progress") else "failed"
    accepted = ("failed", "in_progress") if outcome in ("never", "miss") else ()
    contacts, moves = _contacts(times, outcome, drop_s), _moves(times, outcome, drop_s)
    return TaskTruth(outcome, verdict, stages, accepted, contacts, moves), name, text


def _stages(times: PickTimes, outcome: str, drop_s: float, short: bool) -> tuple[StageSpan, ...]:
    t = times
    rows: list[tuple[str, float, float] | tuple[str, float, float, str]]
    rows = [("reach", t.begin, t.arrive)]
    if outcome == "retry":
        rows += [("slip", t.slip, t.again), ("reach", t.again, t.grasp - 0.3)]
    if outcome in ("never", "miss"):
        return stage_spans(*rows, ("grasp", t.grasp, t.lift + 0.4, "failing"))
    rows.append(("grasp", t.grasp, t.lift))
    fails = outcome == "drop"
    if short:
        # Without a lift stage, the grasp lasts until the part begins to approach the fixture.
        on = t.lift + 0.7 * (t.carry - t.lift)
        rows[-1] = ("grasp", t.grasp, on)
        rows.append(("carry", on, drop_s, "failing") if fails else ("carry", on, t.place))
    else:
        rows.append(("lift", t.lift, t.carry))
        rows.append(("carry", t.carry, drop_s, "failing") if fails else ("carry", t.carry, t.place))
    if fails:
        return stage_spans(*rows)
    if outcome == "wrong_place":
        return stage_spans(*rows, ("place", t.place, t.release, "failing"))
    rows.append(("place", t.place, t.release))
    if short:
        return stage_spans(*rows, ("withdraw", t.release, t.end))
    return stage_spans(*rows, ("release", t.release, t.leave), ("retreat", t.leave, t.end))


def _contacts(times: PickTimes, outcome: str, drop_s: float) -> tuple[Contact, ...]:
    if outcome in ("never", "miss"):
        return ()
    found = []
    if outcome == "retry":
        found.append(Contact("gripper", "part", times.slip - 0.1, times.slip + 0.1))
    found.append(Contact("gripper", "part", times.grasp, min(times.release, drop_s)))
    if outcome not in ("drop", "wrong_place"):
        found.append(Contact("part", "fixture", times.place, times.end))
    return tuple(found)


def _moves(times: PickTimes, outcome: str, drop_s: float) -> tuple[Motion, ...]:
    found = [Motion("gripper", times.begin, times.arrive)]
    if outcome == "retry":
        found.append(Motion("gripper", times.slip, times.grasp - 0.3))
    found += [Motion("gripper", times.lift, times.place), Motion("gripper", times.leave, times.end)]
    if outcome not in ("never", "miss"):
        found.append(Motion("part", times.lift, min(times.place, drop_s + 0.4)))
    return tuple(found)
