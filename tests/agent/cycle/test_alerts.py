from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Alert, AlertCondition, Severity
from visup.agent.cycle.alerts import CLOSING_DELAY_S, RECOVERY_S, update_alerts

STEP_S = 0.25


def condition(kind: str) -> AlertCondition:
    return AlertCondition(kind, (1, 2), Severity.WARNING, f"{kind}.")


@given(st.lists(st.sets(st.sampled_from(["a", "b", "c"])), max_size=40))
def test_alerts_open_renew_and_close(history: list[set[str]]) -> None:
    """Open exactly while the concern held within the grace time; numbers never repeat."""
    alerts: tuple[Alert, ...] = ()
    ids: list[int] = []
    last: dict[str, float] = {}
    for i, kinds in enumerate(history):
        now = i * STEP_S
        last |= dict.fromkeys(kinds, now)
        alerts, opened, closed = update_alerts(
            alerts, [condition(k) for k in sorted(kinds)], now, len(ids) + 1
        )
        ids += [a.id for a in opened]
        expected = {k for k, t in last.items() if now - t <= CLOSING_DELAY_S}
        assert {a.kind for a in alerts} == expected
        assert all(a.closed is None for a in alerts)
        assert all(a.closed == now for a in closed)
        last = {k: t for k, t in last.items() if k in expected}
    assert ids == sorted(set(ids))


def test_equal_conditions_open_one_alert_of_the_greater_severity() -> None:
    grave = AlertCondition("a", (1,), Severity.CRITICAL, "Grave.")
    mild = AlertCondition("a", (1,), Severity.WARNING, "Mild.")
    alerts, opened, _ = update_alerts((), [mild, grave, mild], 0.0, 1)
    assert [a.severity for a in alerts] == [Severity.CRITICAL]
    assert alerts == opened


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.sampled_from(["region", "lamp"]))
def test_alerts_stay_open_while_a_needed_kind_is_unknown(blind: list[bool], kind: str) -> None:
    """Its concern held once; then it closes as soon as sight has been back for long enough."""
    alerts, _, _ = update_alerts((), [condition("a")], 0.0, 1)
    last_blind = float("-inf")
    for i, unknown in enumerate(blind, start=1):
        now = i * STEP_S
        kinds = frozenset({kind}) if unknown else frozenset()
        alerts, _, closed = update_alerts(alerts, [], now, 2, kinds)
        if unknown and "region" in kinds:
            last_blind = now
        assert bool(closed) == (now > CLOSING_DELAY_S and now - last_blind > RECOVERY_S)
        if closed:
            return
