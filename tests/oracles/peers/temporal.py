"""Formulas of peers, written in our language, judged over their signals with the ends they choose."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from math import inf, isclose
from typing import Any

from tests.oracles.peers.translation import NotExpressibleError, Translator, walk, word
from visup.agent.model.errors import VisupError
from visup.rules.dense_time import Ends, judge_recording
from visup.rules.dense_time.monitor import After, Before, Reading, TimedVerdict
from visup.rules.language.parser import parse_formula
from visup.rules.monitoring.intervals import Interval
from visup.rules.predicates.vocabulary import signals

Case = Mapping[str, Any]
READINGS: Mapping[str, Reading] = {
    "samples": "samples",
    "dense-held": "held",
    "dense-linear": "linear",
}
OTHERWISE = (
    "an empty window",
    "== is inf or -inf",
    "iff is -|a-b|",
    "since and the moment of b: a is asked there too",
)
"""What of a peer's semantics cannot be chosen here; `docs/coming-from.md` says each."""
AGREE, UNKNOWN, OTHER, DIFFER, NOT_EXPRESSIBLE = (
    "agree",
    "unknown_at_ends",
    "other_semantics",
    "differ",
    "not_expressible",
)


def outcome_of(case: Case) -> str:
    """How a case comes out: one of the five outcomes."""
    try:
        told = judge(case)
    except (NotExpressibleError, VisupError):
        return OTHER if _otherwise(case) else NOT_EXPRESSIBLE
    found = {_compared(case, _at(told, time), expected) for time, expected in case["expected"]}
    if DIFFER in found:
        return OTHER if _otherwise(case) else DIFFER
    return UNKNOWN if UNKNOWN in found else AGREE


def judge(case: Case) -> list[TimedVerdict]:
    """What our language says of a case at every moment.

    Raises:
        NotExpressibleError: It cannot be said.
        VisupError: It is refused.
    """
    rows = case["signals"].values()
    # Nothing is said before all signals have begun.
    first = max((r[0][0] for r in rows), default=0)
    asked = [t for t, _ in case["expected"]]
    times = sorted({t for r in rows for t, _ in r if t >= first}) or asked
    samples = case["time"] == "samples"
    last = times[-1] + 1 if samples else max([times[-1], *asked]) + 1e-6
    source = translated(case, last - times[0] + 1)
    formula = parse_formula(source, signals(*map(word, case["signals"])))
    before, after = ends(case)
    if after == "unknown" and max(asked, default=0) > times[-1]:
        after = "lasting"  # so a peer that tells of moments after the last sample takes it
    return judge_recording(
        formula,
        [(t, _values(case, t)) for t in times],
        reading_of(case),
        Ends(before, after),
        end_s=last,
    )


def translated(case: Case, span: float) -> str:
    """The formula of a case in our language."""
    said = " | ".join(case["semantics"])
    return Translator(
        case["peer"],
        span,
        "ask for both a and b" in said,
        "a is asked from now + lo on" in said,
        "iff is -|a-b|" in said,
        "previous is false" in said,
        case["time"] == "samples",
    ).formula(case["formula"])


def reading_of(case: Case) -> Reading:
    """How the peer takes signals between samples.

    In reelay a value holds up to and with the next sample, so that `since` asks a of the pieces after
    that of b, which is what is asked over samples; where both change at once the two still differ.
    """
    pieces = case["peer"] == "reelay" and case["time"] == "dense-held"
    return "samples" if pieces else READINGS[case["time"]]


def ends(case: Case) -> tuple[Before, After]:
    """What is before and after the recording, as the peer takes it."""
    said = " | ".join(case["semantics"])
    first = ("past windows are cut", "previous is", "strong_previous", "before the first as")
    final = ("future windows are cut", "next is", "strong_next")
    before: Before = "cut" if any(w in said for w in first) else "unknown"
    after: After = "cut" if any(w in said for w in final) else "unknown"
    # In rtamt's dense time a window that begins after the end has the last value.
    lasting = ("last value of a signal lasts on", "cut at the end of the signals")
    return before, "lasting" if any(w in said for w in lasting) else after


def _values(case: Case, time: float) -> dict[str, float | Interval | None]:
    """The value of each signal at a moment: the last one given, or between two on their line."""
    linear = case["time"] == "dense-linear"
    facts = _facts(case)
    found: dict[str, float | Interval | None] = {}
    for name, rows in case["signals"].items():
        k = bisect_right([t for t, _ in rows], time) - 1
        value = None if k < 0 else float(rows[k][1])
        if linear and value is not None and k + 1 < len(rows):
            (t0, v0), (t1, v1) = rows[k], rows[k + 1]
            value = v0 + (v1 - v0) * (time - t0) / (t1 - t0)
        if name in facts and value is not None and not linear:
            value = inf if value > 0 else -inf
        found[word(name)] = value
    return found


def _facts(case: Case) -> set[str]:
    """The signals that are true or false and no matter of degree."""
    tree = list(walk(case["formula"]))
    named = {t["name"] for t in tree if t["op"] == "proposition"}
    named -= {t["name"] for t in tree if t["op"] == "variable"}
    return {n for n in named & set(case["signals"]) if {v for _, v in case["signals"][n]} <= {0, 1}}


def _at(told: list[TimedVerdict], time: float) -> Interval:
    for piece in told:
        if piece.begin_s <= time < piece.end_s:
            return piece.robustness
    return (-inf, inf)


def _compared(case: Case, told: Interval, expected: float | str) -> str:
    value = float(expected)
    low, high = told
    if case["kind"] == "boolean":
        truth = value > 0
        if low > 0 or high < 0:
            return AGREE if (low > 0) == truth else DIFFER
        return UNKNOWN
    if low == high:
        same = low == value or isclose(low, value, rel_tol=2e-5, abs_tol=2e-6)
        return AGREE if same else DIFFER
    slack = 2e-5 * abs(value) + 2e-6
    return UNKNOWN if low - slack <= value <= high + slack else DIFFER


def _otherwise(case: Case) -> bool:
    return any(o in s for s in case["semantics"] for o in OTHERWISE)
