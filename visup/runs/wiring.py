"""The wiring: builds an agent with behaviours and reasoners from the settings of a run."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from visup.agent import Behaviour, Contract, Frame, Mind, Verdict, Zone
from visup.agent.contract.limits import Limits
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.cycle.system_alerts import grave_kinds, verdict_without_task
from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Observer, Step
from visup.agent.model.task_beliefs import TaskBelief
from visup.percepts.appearance.behaviour import AppearanceBehaviour
from visup.percepts.appearance.placed_objects import PlacedObjectBehaviour
from visup.percepts.colour import ColourBehaviour
from visup.percepts.depth import DepthBehaviour
from visup.percepts.detections import (
    DetectionsBehaviour,
    DetectorBehaviour,
    NetworkBehaviour,
    read_detections,
)
from visup.percepts.health import HealthBehaviour
from visup.percepts.motion.behaviour import MotionBehaviour
from visup.percepts.motion.pausing import PausingMotionBehaviour
from visup.percepts.shape.behaviour import ShapeBehaviour
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.video import VideoSource, open_source
from visup.percepts.video.image_folder import image_names
from visup.rules.activation.activation import ActivationReasoner, activation_rules, always_active
from visup.rules.activation.attention import AttentionReasoner
from visup.rules.identity import VoteSettings
from visup.rules.language.diagnostics import either
from visup.rules.language.parser import load_rules, shipped_rules
from visup.rules.monitoring.intervals import AtEnd
from visup.rules.reasoners import ReasonerSettings, default_reasoners
from visup.rules.safety.pending_verdicts import open_rules
from visup.runs.inputs.plugins import user_behaviours
from visup.runs.inputs.presets import every_for, preset_named
from visup.runs.inputs.signals import check_signals, signal_behaviours
from visup.runs.inputs.zones import load_ground, load_zones
from visup.runs.runtime_faults import runtime_fault_reasoner
from visup.runs.settings import WatchSettings
from visup.tasks import load_tasks
from visup.tasks.casting.fitness import asks_for_colour, asks_for_traits
from visup.tasks.grammar.criteria import Place
from visup.tasks.grammar.structure import (
    declared_sizes,
    needs_ground,
    spare_kinds,
    task_actors,
    undrawn_zones,
    with_bystanders,
    with_taught_actors,
)
from visup.tasks.supervision.supervise import finish, task_reasoner

if TYPE_CHECKING:
    from visup.rules.formula.nodes import Rule
    from visup.tasks.grammar.nodes import Task

LIVE_HANG_S = 20.0
"""Time limit of a behaviour on a live frame, seconds: enough for compiling loops at the first frames after an
installation."""

__all__ = ["WatchSettings", "build_agent", "final_verdict", "open_video", "reasoning_agent"]


def open_video(settings: WatchSettings, span: tuple[int, int | None] = (0, None)) -> VideoSource:
    """Open the source of a run.

    Args:
        settings: Settings of the run.
        span: Which of its frames to read; see `VideoSource`.

    Raises:
        SourceError: It cannot be opened.
    """
    source = open_source(
        settings.source,
        every=settings.every,
        fps=settings.fps,
        patience_s=settings.patience_s,
    )
    if settings.every == 1:
        source.every = _every(settings, source.fps)
    source.span = span
    return source


def _every(settings: WatchSettings, fps: float) -> int:
    """The frame stride n (every n-th frame); an explicit setting takes precedence over the preset."""
    if settings.pace is not None:
        return every_for(settings.pace, fps)
    return preset_named(settings.preset).every(fps) if settings.preset else 1


def build_agent(
    settings: WatchSettings,
    observers: Sequence[Observer] = (),
    extra: Sequence[Behaviour] = (),
    *,
    live: bool = False,
) -> Agent:
    """Build an agent with perception and reasoning.

    Args:
        settings: Settings of the run.
        observers: Receive each step.
        extra: Behaviours besides those of the settings.
        live: Whether the source is live, so that a hanging behaviour must be reported soon.

    Raises:
        VisupError: A task, rules file, zones file, model database or behaviour is not valid, or an actor is
            bound that no task has, or to a model that the database lacks.
    """
    tasks, zones = _tasks_and_zones(settings)
    database = ModelDatabase.shared(settings.models) if settings.models else None
    _check_actors(settings, tasks, database)
    model_names, taught = _names(database)
    boxes = _detector(settings)
    model_names = (
        *model_names,
        *(n for n in (boxes.names if boxes else ()) if n not in model_names),
    )
    actors = with_taught_actors(tasks, settings.actors, model_names, taught)
    behaviours = [
        *_behaviours(
            settings, database, boxes, declared_sizes(tasks, actors), _initial_positions(tasks)
        ),
        *([ColourBehaviour()] if any(map(asks_for_colour, tasks)) else []),
        *(signals := signal_behaviours(settings.signals)),
        *extra,
    ]
    contracts = [b.contract for b in behaviours]
    check_signals(contracts, signals, _rules(settings), tasks)
    return Agent(
        behaviours=behaviours,
        reasoners=_reasoners(settings, tasks, contracts),
        actors=actors,
        zones=zones,
        cast={**_cast(tasks), **actors},
        observers=observers,
        models=model_names,
        limits=replace(
            _limits(settings, live), never_asleep=always_active(contracts, _rules(settings))
        ),
    )


def _detector(settings: WatchSettings) -> DetectorBehaviour | None:
    """The detector behaviour that replaces motion segmentation, or None."""
    if settings.detections is None:
        return None
    if settings.detections.suffix.lower() == ".onnx":
        return NetworkBehaviour(settings.detections)
    return DetectionsBehaviour(read_detections(settings.detections, image_names(settings.source)))


def _names(database: ModelDatabase | None) -> tuple[tuple[str, ...], frozenset[str]]:
    """Names of all models, and of the taught ones."""
    if database is None:
        return (), frozenset()
    return database.names(), frozenset(view.name for view in database.taught)


def reasoning_agent(
    settings: WatchSettings,
    observers: Sequence[Observer] = (),
    behaviours: Sequence[Behaviour] = (),
) -> Agent:
    """Build an agent that reasons about recorded observations, without perception.

    Args:
        settings: Settings of the run.
        observers: Receive each step.
        behaviours: Behaviours in place of perception.

    Raises:
        VisupError: A task, rules or zones file is not valid, or an actor is bound that no task has.
    """
    tasks, zones = _tasks_and_zones(settings)
    _check_actors(settings, tasks, None)
    if behaviours and any(map(asks_for_colour, tasks)):
        behaviours = (*behaviours, ColourBehaviour())
    return Agent(
        behaviours=behaviours,
        reasoners=_reasoners(settings, tasks, [b.contract for b in behaviours]),
        actors=settings.actors,
        zones=zones,
        cast=_cast(tasks),
        observers=observers,
    )


def _tasks_and_zones(settings: WatchSettings) -> tuple[list[Task], tuple[Zone, ...]]:
    """The tasks of a run and the zones of its settings; tasks without a ground use that of the zones."""
    loaded = [t for name in settings.tasks for t in load_tasks(name)]
    tasks = [with_bystanders(t, settings.bystanders) for t in loaded]
    zones = load_zones(settings.zones) if settings.zones else ()
    ground = load_ground(settings.zones) if settings.zones else None
    if ground is not None:
        tasks = [t if t.ground else replace(t, grounds=(ground,)) for t in tasks]
    _check_zones(tasks, {z.name for z in zones})
    return tasks, zones


def _cast(tasks: Sequence[Task]) -> dict[str, tuple[str, ...]]:
    """Actor -> models of all tasks: names for the operator's answers."""
    return {a: t.models(a) for t in tasks for a in task_actors(t)}


def final_verdict(mind: Mind) -> Verdict:
    """The verdict of a run that has ended.

    With tasks it is the most severe one of those observed, unknown if none was; without, it follows from the
    open alerts.
    """
    if mind.tasks:
        verdicts = [finish(t) for t in mind.tasks]
        observed = [v for v in verdicts if v is not Verdict.UNKNOWN]
        return max(observed or verdicts, key=_BY_SEVERITY.index)
    return verdict_without_task(grave_kinds(mind.alerts)) or Verdict.SUCCEEDED


def closing_notes(mind: Mind, at_end: AtEnd | str) -> tuple[str, ...]:
    """What a run leaves open: undecided rules, and actors of tasks of which nothing was seen.

    Args:
        mind: The mind after the last step.
        at_end: How rules that are still undecided count; see `open_rules`.
    """
    return (*map(str, open_rules(mind, at_end)), *_missing_actors(mind.tasks))


def _missing_actors(tasks: Iterable[TaskBelief]) -> Iterator[str]:
    for task in tasks:
        missing = [f"the {b.actor}" for b in task.bindings if b.object_id is None]
        if task.verdict is Verdict.UNKNOWN and missing:
            what = f"Task '{task.task}': nothing was found that is {either(missing)}."
            yield f"{what} {UNSEEN_AT_REST}"


UNSEEN_AT_REST = (
    "What never moves is seen only if it was taught, or if its actor is declared with its place."
)
_BY_SEVERITY = (
    Verdict.SUCCEEDED,
    Verdict.IN_PROGRESS,
    Verdict.UNKNOWN,
    Verdict.FAILED,
    Verdict.INTERRUPTED,
)


class VerdictMonitor:
    """An observer that derives the verdict of a run without a task from its events.

    Args:
        verdict: The verdict before.

    Attributes:
        verdict: The verdict so far.
    """

    def __init__(self, verdict: Verdict | None) -> None:
        self.verdict = verdict

    def __call__(self, step: Step, frame: Frame) -> None:
        """Add one step."""
        self.verdict = verdict_without_task(grave_kinds(step.events), self.verdict)


def _limits(settings: WatchSettings, live: bool) -> Limits:
    limits = Limits(budgets=settings.budgets, isolate=frozenset(settings.isolate))
    return replace(limits, hang_s=LIVE_HANG_S, longer_hangs=False) if live else limits


def _behaviours(
    settings: WatchSettings,
    database: ModelDatabase | None,
    boxes: DetectorBehaviour | None,
    sizes_m: Mapping[str, float],
    places: Mapping[str, tuple[float, float]],
) -> list[Behaviour]:
    taught = database.taught if database is not None else ()
    segmenter = PausingMotionBehaviour(settings.rest_s) if settings.rest_s else MotionBehaviour()
    motion: Behaviour = AppearanceBehaviour(taught) if taught else segmenter
    if places:
        motion = PlacedObjectBehaviour(places, taught)
    if boxes:
        return [HealthBehaviour(), boxes, *user_behaviours(settings)]
    if not settings.motion:
        return [HealthBehaviour(), *user_behaviours(settings)]
    seeing: list[Behaviour] = [HealthBehaviour(), motion]
    if database is not None:
        seeing += [
            ShapeBehaviour(database),
            DepthBehaviour(database, settings.fov_vertical_deg, sizes_m),
        ]
    return [*seeing, *user_behaviours(settings)]


def _initial_positions(tasks: Sequence[Task]) -> dict[str, tuple[float, float]]:
    """Actors identified by position instead of a model: their positions in the first frame."""
    return {
        a.name: c.at
        for t in tasks
        for a in t.actors
        for c in a.criteria
        if isinstance(c, Place) and not a.models
    }


def _rules(settings: WatchSettings) -> tuple[Rule, ...]:
    given = tuple(r for path in settings.rules for r in load_rules(path))
    left_out = preset_named(settings.preset).without if settings.preset else ()
    return given or tuple(r for r in shipped_rules() if r.name not in left_out)


def _reasoners(
    settings: WatchSettings, tasks: Sequence[Task], contracts: Sequence[Contract] = ()
) -> Reasoners:
    traits = any(map(asks_for_traits, tasks))
    reasoner_settings = ReasonerSettings()
    if settings.preset:
        reasoner_settings = ReasonerSettings(objects=preset_named(settings.preset).objects)
    if settings.vote_evidence is not None:
        reasoner_settings = replace(
            reasoner_settings, votes=VoteSettings(evidence=settings.vote_evidence)
        )
    reasoners = default_reasoners(
        reasoner_settings, _rules(settings), traits=traits, early=settings.early
    )
    attention = (AttentionReasoner(),) if settings.attention else ()
    rules = activation_rules(contracts)
    activation = (ActivationReasoner(rules),) if rules else ()
    return Reasoners(
        reasoners.update,
        reasoners.cogitate,
        match=(task_reasoner(tasks),) if tasks else (),
        attend=(*attention, *activation, runtime_fault_reasoner),
    )


def _check_zones(tasks: Sequence[Task], defined: Collection[str]) -> None:
    """Check that every zone used is defined."""
    for task in tasks:
        if needs_ground(task) and task.ground is None:
            raise SettingsError(
                f"task `{task.name}` speaks of metres on the floor, but nothing says where the floor is",
                where=task.file,
                expected="`ground is (80, 400) = (0 m, 0 m), ...`, or a zones file with [ground]",
            )
        for zone in undrawn_zones(task):
            if zone in defined:
                continue
            raise SettingsError(
                f"zone `{zone}` of task `{task.name}` is not drawn anywhere",
                where=task.file,
                expected=f"`zone {zone} is (100, 50) (300, 50) (300, 200)`, or a zones file with it",
            )


def _check_actors(
    settings: WatchSettings, tasks: Sequence[Task], database: ModelDatabase | None
) -> None:
    known = {actor for task in tasks for actor in (*task_actors(task), *spare_kinds(task))}
    for actor, models in settings.actors.items():
        if tasks and actor not in known:
            raise SettingsError(
                f"no task has an actor called '{actor}'",
                expected=f"one of: {', '.join(sorted(known))}",
                hint=did_you_mean(actor, known),
            )
        for model in models:
            if database is not None and model not in database.names():
                raise SettingsError(
                    f"the actor '{actor}' stands for '{model}', which is not in the model database",
                    where=str(settings.models),
                    expected=f"one of: {', '.join(database.names())}",
                    hint=did_you_mean(model, database.names()),
                )
