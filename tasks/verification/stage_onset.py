"""Estimates when a stage began, once its beginning has been confirmed.

Confirmation takes time: a trend must be significant and last, a coupling must pass a test. So a stage is
reported to have begun later than it most probably did. This module estimates its onset from the observations
up to the report.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from visup.rules.relations.samples import SampleWindow
from visup.rules.relations.trend import trend_onset
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.automaton.states import Leaf
from visup.tasks.verification.observe import TRENDS
from visup.tasks.verification.step_monitor import StepMonitor

Objects = Callable[[tuple[str, ...]], tuple[int, ...]]
"""Actors -> ids of their objects, without unbound ones."""

DATED = frozenset({"converging", "diverging", "decoupled", "coupled", "gone", "present"})
"""Relations that are confirmed later than they set in, so that their onset is estimated.

A contact is not among them: outlines meet before bodies do (by 0.4 s on average in rendered worlds), so that
the time of its report is more accurate than its apparent onset."""


def stage_onset(
    leaves: Sequence[Leaf[StepMonitor]],
    actions: Mapping[str, ActionDefinition],
    objects: Objects,
    now: float,
    window: SampleWindow,
) -> float:
    """When a stage most probably began whose beginning has been confirmed now.

    A stage begins with the last of its steps. It is dated back only if the action of that step is confirmed
    late (`DATED`), and no further than to when the previous stage began, or had lasted as long as required.

    Args:
        leaves: Its active steps with their monitors.
        actions: Action definitions by name.
        objects: Gives the objects of actors.
        now: Current time, seconds.
        window: The samples of the last seconds.

    Returns:
        The onset in seconds, at most `now`.
    """
    found = [_onset(x, actions[x.step.action], objects, window) for x in leaves]
    last, late = max((f for f in found if f is not None), default=(now, False))
    if not late:
        return now
    earliest = max(x.payload.earliest for x in leaves)
    return min(now, max(last, earliest))


def _onset(
    leaf: Leaf[StepMonitor], meaning: ActionDefinition, objects: Objects, window: SampleWindow
) -> tuple[float, bool] | None:
    """The onset of an observed step, and whether it is confirmed late; None if it was not observed."""
    name, since = leaf.payload.helped_by, leaf.payload.helped_since
    if name is None or since is None:
        return None
    found = _departure(name, objects(leaf.step.actors), window)
    return since if found is None else min(found, since), name in DATED and name in meaning.begins


def _departure(name: str, ids: tuple[int, ...], window: SampleWindow) -> float | None:
    """When a trend between two objects set in, or None; that of `decoupled` is that they diverge."""
    trend = "diverging" if name == "decoupled" else name
    if trend not in TRENDS or len(ids) != 2:
        return None
    return trend_onset(window, ids[0], ids[1], trend)
