"""How patient, how forgiving and how sure supervision is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TaskSettings:
    """Settings of task supervision; times in seconds.

    Attributes:
        bind_at: An object may play an actor when this share of its votes is for the actor's models.
        keep_bonus: What is added to the strength of a pair that is already bound, so that bindings
            do not flicker.
        switch_s: Another object must be the better match for so long before an actor, whose object
            is still there, changes hands.
        enter_s: A relation must be true so long before it counts as the entry to a stage.
        contact_s: A contact that ended no longer ago still counts as the entry to a stage.
        contrary_s: The contrary of an action must hold so long before a begun stage fails.
        contrary_early_s: The same for a stage that has not begun yet.
        recover_s: A failing stage must make progress so long before it counts as recovered.
        recover_share: The same as a share of the time for which it has been failing; the longer one counts.
        stalled_s: A begun stage without progress for so long is stalled.
        unseen_s: A stage whose actors were not observed for so long is unknown.
        gap_s: A break of a `for` shorter than this is forgiven.
        failed_s: A stage that has been failing for so long has failed; it must then make progress for
            as long to count as recovered.
        early_s: What a stage asks for and was so before its turn may stay so for so long, before that
            speaks against the course: who picks a part up from a tray may put it back on the tray.
        regret_s: A task that is done may be undone by contrary evidence for so long.
        unexplained_s: An object that no actor explains must be there so long to be named.
        scenery_s: What nobody knows and was in view so soon after the start belongs to the scene, as the
            rest of a machine does of which a part alone is known.
        familiar: An object whose best identity has at least this share is taken to be identified.
        acquainted_s: Seconds for which an object must have been in the scene before it is taken for something
            other than an actor that is still looked for.
        most_courses: How many courses of a task are followed side by side.
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
