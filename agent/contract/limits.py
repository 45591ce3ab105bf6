"""Limits of time and memory for behaviours.

The policy, in one place:

- *By default no decision depends on the speed of the machine.* A run may take up to `hang_s`, which is so
  long that only a hang exceeds it, even on a busy machine or disk; the same frames give the same steps.
- *Budgets are optional* (`budgets=True`), for frames in real time: a run that takes longer than its
  contract's `cost_ms` is abandoned, and its output is unavailable in that step.
- *Within the process* a behaviour runs in a thread of its own. The step waits for it no longer than the
  limit. Python cannot kill a thread: an abandoned one is asked to stop, which stops Python code but not code
  that is stuck in a library; the behaviour counts as late until it returns, and its late answer is dropped.
- *In a process of its own* (`isolate`) the limits are hard: a run that takes too much time or memory is
  killed with its process, and a new process is started in the initial state.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from visup.agent.contract.contract import Contract


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of all behaviours.

    Attributes:
        hang_s: A run that takes longer is abandoned, seconds. None runs behaviours in the caller's thread
            without any limit: for debuggers and profilers.
        longer_hangs: Whether a contract may request a longer `hang_s`, for compilation in its first runs;
            not for live sources, where a hang must be reported soon.
        start_s: Time for a behaviour to start (import libraries, load models), seconds.
        budgets: Whether the contract's `cost_ms` limits each run as well.
        budget_ms: Budget of behaviours that declare none, milliseconds.
        memory_mb: Memory limit of behaviours that declare none, megabytes.
        isolate: Names of behaviours that run in their own processes, whatever their contracts say.
        in_process: Whether all run in this process, whatever contracts say: for debuggers and checkers.
        never_asleep: Names of behaviours that never sleep, whatever their contracts say: those that safety
            rules need (`rules/activation/activation.py`).
        clock: Clock for the time of a run, seconds.
    """

    hang_s: float | None = 60.0
    longer_hangs: bool = True
    start_s: float = 60.0
    budgets: bool = False
    budget_ms: float = 1000.0
    memory_mb: float = 2048.0
    isolate: frozenset[str] = frozenset()
    in_process: bool = False
    never_asleep: frozenset[str] = frozenset()
    clock: Callable[[], float] = time.perf_counter

    def seconds(self, contract: Contract) -> float | None:
        """Time limit of one run, seconds; None for no limit."""
        if not self.budgets:
            if self.hang_s is None or not self.longer_hangs:
                return self.hang_s
            return max(self.hang_s, contract.hang_s or 0.0)
        budget = (contract.cost_ms or self.budget_ms) / 1000.0
        return budget if self.hang_s is None else min(budget, self.hang_s)

    def sleeps(self, contract: Contract) -> bool:
        """Whether it runs only while it is awake."""
        return bool(contract.awake) and contract.name not in self.never_asleep

    def megabytes(self, contract: Contract) -> float:
        """Memory limit, megabytes."""
        return contract.memory_mb or self.memory_mb

    def isolated(self, contract: Contract) -> bool:
        """Whether it runs in its own process."""
        return not self.in_process and (contract.isolate or contract.name in self.isolate)
