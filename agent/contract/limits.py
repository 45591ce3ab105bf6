"""How an agent holds its behaviours to limits of time and memory.

The policy, in one place:

- *By default no decision hangs on how fast the machine is.* A run may take as long as it likes up to
  `hang_s`, which is so long that only a hang reaches it, even where others keep the machine or its disk
  busy; the same frames give the same steps.
- *Budgets are asked for* (`budgets=True`), when frames come in real time: then a run that takes
  longer than its contract's `cost_ms` is given up, and its output is unavailable in that step.
- *Within the process* a run goes to a thread that serves this behaviour alone. The step waits for it
  no longer than the limit. Python cannot kill a thread: one that was given up is asked to stop, which
  stops Python code but not code that is stuck in a library; the behaviour counts as late until it
  is out of it, and its late answer is dropped.
- *In a process of its own* (`isolate`) the limits are hard: a run that takes too long, or too much
  memory, is killed with its process, and a new process is started in the state of the beginning.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from visup.agent.contract.contract import Contract


@dataclass(frozen=True, slots=True)
class Limits:
    """What behaviours are held to.

    Attributes:
        hang_s: A run that takes longer is given up, seconds. None runs behaviours in the thread of
            the caller, without any limit: for debuggers and profilers.
        patient: Whether a contract may ask for a longer `hang_s`, for what is compiled in its first runs. Not
            for live sources, where a hang must be reported soon.
        start_s: How long a behaviour may take to start: to import libraries and load models, seconds.
        budgets: Whether each run is also held to its contract's `cost_ms`.
        budget_ms: Budget of behaviours that declare none, milliseconds.
        memory_mb: How much memory a behaviour may take that declares nothing, megabytes.
        isolate: Names of behaviours that run in processes of their own, whatever their contracts say.
        here: Whether all run in this process, whatever contracts say: for debuggers and checkers.
        wakeful: Names of behaviours that never sleep, whatever their contracts say: those that safety
            rules need (`rules/activation/activation.py`).
        clock: Seconds, by which the time of a run is measured.
    """

    hang_s: float | None = 60.0
    patient: bool = True
    start_s: float = 60.0
    budgets: bool = False
    budget_ms: float = 1000.0
    memory_mb: float = 2048.0
    isolate: frozenset[str] = frozenset()
    here: bool = False
    wakeful: frozenset[str] = frozenset()
    clock: Callable[[], float] = time.perf_counter

    def seconds(self, contract: Contract) -> float | None:
        """How long one run may take; None without limit."""
        if not self.budgets:
            if self.hang_s is None or not self.patient:
                return self.hang_s
            return max(self.hang_s, contract.hang_s or 0.0)
        budget = (contract.cost_ms or self.budget_ms) / 1000.0
        return budget if self.hang_s is None else min(budget, self.hang_s)

    def sleeps(self, contract: Contract) -> bool:
        """Whether it runs only while it is awake."""
        return bool(contract.awake) and contract.name not in self.wakeful

    def megabytes(self, contract: Contract) -> float:
        """How much memory it may take."""
        return contract.memory_mb or self.memory_mb

    def isolated(self, contract: Contract) -> bool:
        """Whether it runs in a process of its own."""
        return not self.here and (contract.isolate or contract.name in self.isolate)
