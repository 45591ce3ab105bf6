"""Parses breakpoints: `alert`, `rule collision_course`, `stage captured`, `when gap(1, 2) < 20 px`."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from visup.agent import Mind
from visup.agent.contract.phases import Phase
from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import SettingsError
from visup.rules.safety.expression import expression
from visup.stepping.breakpoints import (
    AnyStop,
    EventStop,
    FrameStop,
    ObjectStop,
    PhaseStop,
    Predicate,
    PredicateStop,
    RuleStop,
    StageStop,
    StopCondition,
    TimeStop,
    WhenStop,
)
from visup.stepping.names import Names, known_names
from visup.wording import EVENT_KINDS


def parse_condition(
    what: str | Phase | Predicate | StopCondition, mind: Mind, names: Names | None = None
) -> StopCondition:
    """Parse a stop condition.

    Args:
        what: A phase, a function of the step, a condition, or text: `phase match`, `event alert`,
            `rule NAME`, `rule NAME changes`, `stage NAME`, `object 2`, `time 12.5`, `frame 300`,
            `when EXPRESSION`, `change EXPRESSION`; or without its first word if that is unambiguous.
        mind: Provides stages and rules, none before its first step.
        names: Known names; by default those of the mind.

    Raises:
        SettingsError: It is no condition.
        VisupError: The expression is not valid.
    """
    if isinstance(what, Phase):
        return PhaseStop(what)
    if not isinstance(what, str):
        return what if isinstance(what, StopCondition) else PredicateStop(what)
    first, _, rest = what.strip().partition(" ")
    reader = _READERS.get(first) if rest else None
    names = names or known_names(mind)
    return reader(rest.strip(), names) if reader else _inferred(what.strip(), names)


def _inferred(word: str, names: Names) -> StopCondition:
    """The condition of a word without its kind."""
    try:
        return TimeStop(float(word))
    except ValueError:
        pass
    if "(" in word:
        return WhenStop(expression(word))
    if word in tuple(Phase):
        return PhaseStop(Phase(word))
    found: list[StopCondition] = [StageStop(word)] if word in names.stages else []
    found += [RuleStop(word)] if word in names.rules else []
    if word in EVENT_KINDS:
        found.append(EventStop(word))
    if not found:
        raise _unknown_word(word, names)
    return found[0] if len(found) == 1 else AnyStop(word, tuple(found))


def _unknown_word(word: str, names: Names) -> SettingsError:
    """The error for an unknown word; taking it for an event would wait for a typing error until the end."""
    suggestion = did_you_mean(word, [*EVENT_KINDS, *names.stages, *names.rules, *Phase])
    event_hint = f"for an event of your own: event {word}" if word.isidentifier() else None
    return SettingsError(
        f"'{word}' is not known",
        expected="a phase, event, rule, stage, object, time, frame or expression",
        hint=suggestion or event_hint,
    )


def _rule(text: str, names: Names) -> StopCondition:
    name, _, rest = text.partition(" ")
    if names.rules and name not in names.rules:
        raise _unknown("rule", name, names.rules)
    return RuleStop(name, rest.strip() == "changes")


def _stage(name: str, names: Names) -> StopCondition:
    if names.stages and name not in names.stages:
        raise _unknown("stage", name, names.stages)
    return StageStop(name)


def _phase(name: str, names: Names) -> StopCondition:
    if name not in tuple(Phase):
        raise _unknown("phase", name, tuple(Phase))
    return PhaseStop(Phase(name))


def _number(text: str, kind: str) -> float:
    try:
        return float(text.removesuffix("s").strip())
    except ValueError:
        raise SettingsError(f"'{text}' is not a number", expected=f"such as: {kind} 12") from None


_READERS: Mapping[str, Callable[[str, Names], StopCondition]] = {
    "phase": _phase,
    "event": lambda text, names: EventStop(text),
    "rule": _rule,
    "stage": _stage,
    "object": lambda text, names: ObjectStop(int(_number(text, "object"))),
    "time": lambda text, names: TimeStop(_number(text, "time")),
    "frame": lambda text, names: FrameStop(int(_number(text, "frame"))),
    "when": lambda text, names: WhenStop(expression(text)),
    "change": lambda text, names: WhenStop(expression(text), True),
}


def _unknown(kind: str, name: str, known: tuple[str, ...]) -> SettingsError:
    return SettingsError(
        f"there is no {kind} '{name}'",
        expected=f"one of {', '.join(known)}",
        hint=did_you_mean(name, known),
    )
