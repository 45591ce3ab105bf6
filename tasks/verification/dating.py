"""When a stage began, as it looks once its beginning is believed.

What is seen of a beginning is believed late: a trend must stand out and last, a coupling must prove itself.
So the time at which a stage is reported to have begun and the time at which it most probably began are two
things. This module estimates the latter from what has been seen up to the report.
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
"""Ids of the objects of actors."""

DATED = frozenset({"converging", "diverging", "decoupled", "coupled", "gone", "present"})
"""Relations that are believed later than they come about.

A contact is not among them: outlines meet before bodies do (0.4 s in the mean of rendered worlds), so that
its report comes nearer to the truth than its onset."""


def stage_onset(
    leaves: Sequence[Leaf[StepMonitor]],
    actions: Mapping[str, ActionDefinition],
    objects: Objects,
    now: float,
    window: SampleWindow,
) -> float:
    """When a stage most probably began that is believed to have begun now.

    A stage begins with the last of its steps. It is dated back only if that one is believed late, and not
    beyond the time at which the stage before it began, or had lasted as long as it should.

    Args:
        leaves: Its active steps with their monitors.
        actions: Action definitions by name.
        objects: Gives the objects of actors.
        now: Seconds.
        window: The samples of the last seconds.

    Returns:
        Seconds, at most the present time.
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
    """When an observed step set in, and whether that is believed late; None if it was not observed."""
    name, since = leaf.payload.helped_by, leaf.payload.helped_since
    if name is None or since is None:
        return None
    found = _departure(name, objects(leaf.step.actors), window)
    return since if found is None else min(found, since), name in DATED and name in meaning.begins


def _departure(name: str, ids: tuple[int, ...], window: SampleWindow) -> float | None:
    """When two began to draw nearer or apart, or None; what is no longer coupled draws apart."""
    trend = "diverging" if name == "decoupled" else name
    if trend not in TRENDS or len(ids) != 2:
        return None
    return trend_onset(window, ids[0], ids[1], trend)
