"""The slot of a behaviour in an agent: scheduling, failures and suspension.

After three failures in a row a behaviour is suspended, twice as long each time; one that hangs, dies or takes
too much memory is suspended at once. Its output is unavailable from its failure until it has run again, even
in steps in which it was not due.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from visup.agent.contract.behaviour import Behaviour
from visup.agent.contract.contract import Contract
from visup.agent.contract.limits import Limits
from visup.agent.contract.saving import Saveable
from visup.agent.execution.runners import (
    DirectRunner,
    MemoryLimitError,
    ProcessDiedError,
    Runner,
    RunTimeoutError,
    ThreadRunner,
    duration_text,
    error_line,
    resident_mb,
)
from visup.agent.model.events import WAKE, Directive
from visup.agent.model.records import (
    FAULT_STATES,
    Frame,
    Observation,
    PastFrame,
    Percept,
    Report,
    ReportState,
)

FAILURES_BEFORE_SUSPENSION = 3
FIRST_SUSPENSION_S = 1.0
LONGEST_SUSPENSION_S = 60.0
NEVER = float("-inf")


_CONFIGURATION = frozenset({"behaviour", "contract", "limits", "runner", "relieved_by"})
"""Fields fixed when the agent is created; all others are state."""


@dataclass(slots=True)
class BehaviourSlot:
    """A behaviour with its runner and its failure state.

    Attributes:
        behaviour: The behaviour.
        contract: Its contract when it was plugged in.
        limits: Its limits.
        runner: Its runner.
        relieved_by: Names of finer behaviours that replace it while they run.
        last_run: Time of the latest frame on which it ran, seconds.
        failures: Failures in a row.
        error: Error of the latest failure; empty once it has run again.
        suspended_at: Time of the frame at which it was suspended, seconds.
        grown_mb: Growth of this process during its runs, megabytes.
        past: The past frames that it requested.
    """

    behaviour: Behaviour
    contract: Contract
    limits: Limits
    runner: Runner
    relieved_by: frozenset[str] = frozenset()
    last_run: float = NEVER
    failures: int = 0
    error: str = ""
    suspended_at: float = NEVER
    grown_mb: float = 0.0
    past: deque[PastFrame] = field(default_factory=deque)

    @property
    def is_saveable(self) -> bool:
        """Whether the state of the behaviour can be saved; not if it runs in another process."""
        return isinstance(self.behaviour, Saveable) and not self.limits.isolated(self.contract)

    def state_dict(self) -> dict[str, Any]:
        """The state of the slot for a checkpoint."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _CONFIGURATION}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Restore the state of another slot."""
        for name, value in state.items():
            setattr(self, name, value)

    @property
    def suspension_s(self) -> float:
        """Duration of the suspension after its latest failure, seconds."""
        excess = self.failures - FAILURES_BEFORE_SUSPENSION
        return 0.0 if excess < 0 else min(FIRST_SUSPENSION_S * 2.0**excess, LONGEST_SUSPENSION_S)

    def run(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Report:
        """Run it on a frame if it is due.

        Args:
            frame: The frame.
            observation: Reports of earlier behaviours on it.
            directives: Requests of the last step.

        Returns:
            Its report; exceptions are reported, never raised.
        """
        contract = self.contract
        idle = Report(contract.name, ReportState.RESTED, contract.gives)
        asleep = self._asleep(directives)
        if (reason := self._why_not_run(frame.time, asleep)) is not None:
            return replace(idle, state=reason, error=self.error)
        if asleep:
            return replace(idle, error="asleep: nothing requires it")
        finer = [
            r.behaviour for r in observation.reports if r.behaviour in self.relieved_by and _ran(r)
        ]
        if finer:
            return replace(idle, error=f"'{finer[0]}' looks more closely")
        missing = [k for k in contract.needs if not observation.observed(k)]
        if missing:
            blind = any(k in observation.unknown for k in missing)
            state = ReportState.BLIND if blind else ReportState.RESTED
            return replace(idle, state=state, error=f"'{missing[0]}' was not observed")
        if self._is_within(frame.time, self.last_run, contract.every_s):
            return idle
        self.last_run = frame.time
        begin = self.limits.clock()
        try:
            percepts = self._run_within_limits(
                frame, replace(observation, past=tuple(self.past)), directives, begin
            )
        except Exception as fault:
            # Containment: any exception of a plug-in is a failure of that plug-in alone.
            self._fail(fault, frame.time)
            state = ReportState.LATE if isinstance(fault, RunTimeoutError) else ReportState.FAILED
            return replace(idle, state=state, error=self.error, elapsed_ms=self._ms(begin))
        self.failures, self.error = 0, ""
        return replace(idle, state=ReportState.RAN, percepts=percepts, elapsed_ms=self._ms(begin))

    def remember(self, frame: Frame, observation: Observation) -> None:
        """Store a past frame if the contract requests any."""
        if self.past.maxlen:
            self.past.append(PastFrame(frame, observation))

    def _asleep(self, directives: Sequence[Directive]) -> bool:
        name = self.contract.name
        wake_requests = (
            d for d in directives if d.kind == WAKE and d.data.get("behaviour") == name
        )
        return self.limits.sleeps(self.contract) and next(wake_requests, None) is None

    def _why_not_run(self, now: float, asleep: bool) -> ReportState | None:
        """Why the behaviour does not run now after a failure; None if it may."""
        if self.runner.maintain():
            return ReportState.LATE
        if self._is_within(now, self.suspended_at, self.suspension_s):
            return ReportState.SUSPENDED
        if self.error and (asleep or self._is_within(now, self.last_run, self.contract.every_s)):
            return ReportState.SUSPENDED
        return None

    @staticmethod
    def _is_within(now: float, since: float, seconds: float) -> bool:
        # A clock that was set back must not prolong the wait; rounding must not cost a frame.
        return 0.0 <= now - since < seconds - 1e-9

    def _run_within_limits(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive], begin: float
    ) -> tuple[Percept, ...]:
        """Run it within its limits."""
        seconds = self.limits.seconds(self.contract)
        memory_before = resident_mb()
        percepts = self.runner.run(frame, observation, directives, seconds)
        elapsed = self.limits.clock() - begin
        if self.limits.budgets and seconds is not None and elapsed > seconds:
            raise RunTimeoutError(f"it took longer than its budget of {duration_text(seconds)}")
        # Memory freed by others during the run must not offset its later growth.
        self.grown_mb = max(0.0, self.grown_mb + resident_mb() - memory_before)
        limit_mb = self.limits.megabytes(self.contract)
        if self.grown_mb > limit_mb:
            self.grown_mb = 0.0
            raise MemoryLimitError(f"it made the process grow by more than {limit_mb:g} MB")
        return percepts

    def _fail(self, fault: Exception, now: float) -> None:
        self.error = error_line(fault)
        self.failures += 1
        if self._suspends_at_once(fault):
            self.failures = max(self.failures, FAILURES_BEFORE_SUSPENSION)
        if self.failures >= FAILURES_BEFORE_SUSPENSION:
            self.suspended_at = now

    def _suspends_at_once(self, fault: Exception) -> bool:
        """Whether a retry is too expensive: each hang costs its whole limit again."""
        if isinstance(fault, RunTimeoutError):
            return not self.limits.budgets
        return isinstance(fault, ProcessDiedError | MemoryLimitError | MemoryError)

    def _ms(self, begin: float) -> float:
        return (self.limits.clock() - begin) * 1000.0


def _ran(report: Report) -> bool:
    return report.state is ReportState.RAN


def superseded(report: Report, by: BehaviourSlot) -> Report:
    """The report of a failed behaviour after one that it relieves has run in its place.

    The kinds that both give are known.
    """
    if report.state not in FAULT_STATES or report.behaviour not in by.relieved_by:
        return report
    gives = tuple(kind for kind in report.gives if kind not in by.contract.gives)
    return replace(report, gives=gives)


def make_slot(behaviour: Behaviour, limits: Limits) -> BehaviourSlot:
    """Create the slot of a behaviour, with the runner that its contract and the limits require.

    Raises:
        BehaviourError: It must run in its own process, but cannot be sent to one.
    """
    contract = behaviour.contract
    runner: Runner
    if limits.isolated(contract):
        from visup.agent.execution.process_runner import ProcessRunner

        runner = ProcessRunner(behaviour, contract, limits)
    elif limits.hang_s is None:
        runner = DirectRunner(behaviour, contract)
    else:
        runner = ThreadRunner(behaviour, contract, limits.start_s)
    return BehaviourSlot(behaviour, contract, limits, runner, past=deque(maxlen=contract.history))
