"""Settings of task supervision: time constants, tolerances and thresholds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TaskSettings:
    """Settings of task supervision; times in seconds.

    Attributes:
        bind_at: Least share of an object's votes for an actor's models for it to be bound to the actor.
        keep_bonus: Added to the strength of an existing binding, so that bindings do not flicker.
        switch_s: How long another object must be the better match before an actor whose object is still
            there is bound to it.
        enter_s: How long a relation must be true before it counts as the entry to a stage.
        contact_s: A contact that ended at most this long ago still counts as the entry to a stage.
        contrary_s: How long the contrary of an action must hold before a begun stage fails, or any stage if
            its course states the contrary, which did not hold when its turn came.
        contrary_early_s: The same for other stages that have not begun yet.
        recover_s: How long a failing stage must make progress before it counts as recovered.
        recover_share: The same as a share of the time for which it has been failing; the longer one counts.
        stalled_s: A begun stage without progress for this long is stalled.
        unseen_s: A stage whose actors were not observed for this long is unknown.
        gap_s: A shorter break of a `for` is tolerated.
        failed_s: A stage that has been failing for this long has failed; it must then make progress for
            as long to count as recovered.
        early_s: How long a relation that held before its stage may still hold in it before it contradicts
            the course: a part picked up from a tray may be put back on the tray.
        regret_s: How long contrary evidence can still undo a completed task.
        unexplained_s: How long an object that no actor explains must be present to be reported.
        scenery_s: An unidentified object that came into view this soon after the start belongs to the scene,
            as does the rest of a machine of which only a part is known.
        familiar: Least share of an object's best identity for it to count as identified.
        acquainted_s: How long an object must have been in the scene before it is taken for something other
            than an actor that is still sought.
        most_courses: Most hypotheses of a task that are tracked in parallel.
    """

    bind_at: float = 0.1
    keep_bonus: float = 0.25
    switch_s: float = 2.0
    enter_s: float = 0.2
    contact_s: float = 1.5
    contrary_s: float = 0.5
    contrary_early_s: float = 2.0
    recover_s: float = 1.0
    recover_share: float = 0.3
    stalled_s: float = 3.0
    unseen_s: float = 2.0
    gap_s: float = 0.5
    failed_s: float = 8.0
    early_s: float = 3.0
    regret_s: float = 10.0
    unexplained_s: float = 0.0
    scenery_s: float = 1.5
    familiar: float = 0.35
    acquainted_s: float = 4.0
    most_courses: int = 24


DEFAULT_SETTINGS = TaskSettings()
