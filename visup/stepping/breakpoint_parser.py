"""Where to stop, in words: `alert`, `rule collision_course`, `stage captured`, `when gap(1, 2) < 20 px`."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from visup.agent import Mind
from visup.agent.contract.phases import Phase
from visup.agent.model.did_you_mean import closest, did_you_mean
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
    rule_names,
    stage_names,
)
from visup.wording import EVENT_KINDS


def parse_condition(what: str | Phase | Predicate | StopCondition, mind: Mind) -> StopCondition:
    """The condition that is meant.

    Args:
        what: A phase, a function of the step, a condition, or text: `phase match`, `event alert`,
            `rule NAME`, `rule NAME changes`, `stage NAME`, `object 2`, `time 12.5`, `frame 300`,
            `when EXPRESSION`, `change EXPRESSION`; or without its first word, where that is clear.
        mind: Knows stages and rules.

    Raises:
        SettingsError: Nothing is meant by it.
        VisupError: The expression cannot be read.
    """
    if isinstance(what, Phase):
        return PhaseStop(what)
    if not isinstance(what, str):
        return what if isinstance(what, StopCondition) else PredicateStop(what)
    first, _, rest = what.strip().partition(" ")
    reader = _READERS.get(first) if rest else None
    return reader(rest.strip(), mind) if reader else _guessed(what.strip(), mind)


def _guessed(word: str, mind: Mind) -> StopCondition:
    """What a word means that is told without its kind."""
    try:
        return TimeStop(float(word))
    except ValueError:
        pass
    if "(" in word:
        return WhenStop(expression(word))
    if word in tuple(Phase):
        return PhaseStop(Phase(word))
    found: list[StopCondition] = [StageStop(word)] if word in stage_names(mind) else []
    found += [RuleStop(word)] if word in rule_names(mind) else []
    if not found or word in EVENT_KINDS:
        found.append(_event(word, mind))
    return found[0] if len(found) == 1 else AnyStop(word, tuple(found))


def _event(kind: str, mind: Mind) -> StopCondition:
    """Any word may be a plug-in's kind of event; one that is nearly another word is a slip."""
    known = [*EVENT_KINDS, *stage_names(mind), *rule_names(mind), *Phase]
    close = closest(kind, known, 0.8)
    if not kind.isidentifier() or (close and kind not in known):
        raise SettingsError(
            f"'{kind}' is not known",
            expected="a phase, event, rule, stage, object, time, frame or expression",
            hint=f"did you mean '{close}'?" if close else None,
        )
    return EventStop(kind)


def _rule(text: str, mind: Mind) -> StopCondition:
    name, _, more = text.partition(" ")
    known = rule_names(mind)
    if known and name not in known:
        raise _unknown("rule", name, known)
    return RuleStop(name, more.strip() == "changes")


def _stage(name: str, mind: Mind) -> StopCondition:
    known = stage_names(mind)
    if known and name not in known:
        raise _unknown("stage", name, known)
    return StageStop(name)


def _phase(name: str, mind: Mind) -> StopCondition:
    if name not in tuple(Phase):
        raise _unknown("phase", name, tuple(Phase))
    return PhaseStop(Phase(name))


def _number(text: str, kind: str) -> float:
    try:
        return float(text.removesuffix("s").strip())
    except ValueError:
        raise SettingsError(f"'{text}' is not a number", expected=f"such as: {kind} 12") from None


_READERS: Mapping[str, Callable[[str, Mind], StopCondition]] = {
    "phase": _phase,
    "event": lambda text, mind: EventStop(text),
    "rule": _rule,
    "stage": _stage,
    "object": lambda text, mind: ObjectStop(int(_number(text, "object"))),
    "time": lambda text, mind: TimeStop(_number(text, "time")),
    "frame": lambda text, mind: FrameStop(int(_number(text, "frame"))),
    "when": lambda text, mind: WhenStop(expression(text)),
    "change": lambda text, mind: WhenStop(expression(text), True),
}


def _unknown(kind: str, name: str, known: tuple[str, ...]) -> SettingsError:
    return SettingsError(
        f"there is no {kind} '{name}'",
        expected=f"one of {', '.join(known)}",
        hint=did_you_mean(name, known),
    )
