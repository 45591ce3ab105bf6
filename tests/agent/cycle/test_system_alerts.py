"""What a run without a task comes to: what was seen is told apart from visup's own troubles."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Alert, Event, Severity, Verdict
from visup.agent.cycle.system_alerts import (
    DELIVERY_ALERTS,
    PERCEPTION_ALERTS,
    grave_kinds,
    verdict_without_task,
)

SEEN = "collision_course"
kinds = st.lists(st.sampled_from([SEEN, "stage_failing", *DELIVERY_ALERTS, *PERCEPTION_ALERTS]))


@pytest.mark.parametrize(
    ("told", "verdict"),
    [
        ([], None),
        (DELIVERY_ALERTS, None),
        (["behaviour_failed"], Verdict.UNKNOWN),
        (["sink_failed", "source_dropped"], Verdict.UNKNOWN),
        ([SEEN], Verdict.INTERRUPTED),
        ([SEEN, *DELIVERY_ALERTS, *PERCEPTION_ALERTS], Verdict.INTERRUPTED),
    ],
)
def test_only_alerts_about_the_scene_interrupt(told: list[str], verdict: Verdict | None) -> None:
    assert verdict_without_task(told) is verdict


@given(kinds, kinds)
def test_the_verdict_is_the_same_in_parts_as_at_once(first: list[str], then: list[str]) -> None:
    assert verdict_without_task(then, verdict_without_task(first)) is verdict_without_task(
        first + then
    )


@given(kinds, st.sampled_from(Severity))
def test_events_and_alerts_give_the_same_verdict(told: list[str], severity: Severity) -> None:
    alerts = [Alert(n, k, severity, 0.0, 0.0, (), "") for n, k in enumerate(told)]
    events = [
        Event("alert", 0.0, 0, "", severity=severity, data={"alert_kind": kind}) for kind in told
    ]
    assert list(grave_kinds(events)) == list(grave_kinds(alerts))
    assert list(grave_kinds(alerts)) == (told if severity > Severity.INFO else [])
