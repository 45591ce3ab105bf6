"""Why, why not and what-if for a recorded run: `visup.stepping` behind a lock, for many pages.

The console adds no logic of its own here. Explanations need the full mind, which a journal does not record,
so the reasoning is replayed up to the moment in question. That takes about a second per thousand frames,
once; the next question continues from there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from visup.agent import Mind
from visup.agent.model.errors import SettingsError
from visup.console.reasoning.debugging import (
    PhaseRecord,
    StopSearchResult,
    phases_of,
    search_stop,
    stop_conditions,
)
from visup.rules.language.parser import parse_rules
from visup.runs.replay import TranscriptDiff
from visup.stepping import Stepper
from visup.stepping.explanations.evidence import Why
from visup.stepping.what_if import with_rules, with_tasks
from visup.tasks import parse_task
from visup.terminal.what_if_commands import parse_assumption

_INCLUDE = re.compile(r"^[^#\n]*\binclude\b", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class BranchComparison:
    """The difference between a branch and the run.

    Attributes:
        assumption: The assumption, in words.
        differences: Events of only one of the two, and both verdicts.
        end: End of the comparison, seconds.
    """

    assumption: str
    differences: TranscriptDiff
    end: float


class Inquiry:
    """Questions about one run.

    Args:
        folder: Folder of the run.

    Raises:
        VisupError: Its reasoning cannot be replayed.
    """

    def __init__(self, folder: Path) -> None:
        self._stepper, self._lock = Stepper.of_run(folder), Lock()

    def why(self, number: int, what: str) -> Why:
        """Explain a belief after a step, as `why` in `visup step`; `not ...` asks why not.

        Args:
            number: Number of the step, from 1.
            what: Such as `alert 2`, `touching 1 2`, `identity 1`, `verdict`, `not coupled 1 2`.

        Raises:
            VisupError: There is nothing to explain.
        """
        text = " ".join(what.split())
        with self._lock:
            self._stepper.go(number)
            if text.partition(" ")[0] == "not":
                return self._stepper.why_not(text.removeprefix("not").strip())
            return self._stepper.why(text)

    def mind(self, number: int) -> Mind:
        """The full mind after a step, including relations.

        Args:
            number: Number of the step, from 1.

        Raises:
            VisupError: There is no such step.
        """
        with self._lock:
            self._stepper.go(number)
            return self._stepper.mind

    def next_stop(
        self, number: int, conditions: Sequence[str], cancelled: Callable[[], bool] = lambda: False
    ) -> StopSearchResult:
        """The next step after one at which a condition is met.

        Args:
            number: Number of the step, from 1.
            conditions: In the syntax of `break` in `visup step`: `alert`, `rule NAME`, `stage NAME`,
                `when gap(1, 2) < 20 px`.
            cancelled: Whether the search was cancelled.

        Raises:
            VisupError: One of them is not valid.
        """
        with self._lock:
            self._stepper.go(number)
            until = stop_conditions(self._stepper, conditions)
        found, search = (
            StopSearchResult(number),
            search_stop(self._stepper, number, until, cancelled),
        )
        while True:
            with self._lock:
                step = next(search, None)
            if step is None:
                return found
            found = step

    def phases(self, number: int) -> tuple[PhaseRecord, ...]:
        """The effects of each phase of a step.

        Raises:
            VisupError: There is no such step.
        """
        with self._lock:
            return phases_of(self._stepper, number)

    def what_if(self, number: int, what: str, steps: int) -> BranchComparison:
        """How the run would have continued after a step under an assumption.

        Args:
            number: Number of the step, from 1.
            what: `object 2 satellite`, `touching 1 2 false`, `object 1 hidden`.
            steps: Number of steps of the run.

        Raises:
            VisupError: It cannot be assumed.
        """
        words = what.split()
        if not words:
            raise SettingsError("no belief was given", expected="such as: object 2 satellite")
        with self._lock:
            self._stepper.go(number)
            stepper = self._stepper
            branch = stepper.branch(parse_assumption(stepper.mind, words, stepper.agent.models))
            return _compared(" ".join(words), branch, steps - number)

    def what_if_answered(
        self, number: int, object_id: int, name: str, steps: int
    ) -> BranchComparison:
        """How the run would have continued if its operator had identified an object after a step.

        Args:
            number: Number of the step, from 1.
            object_id: The object.
            name: A model, an actor, or 'unknown'.
            steps: Number of steps of the run.

        Raises:
            VisupError: There is no such object or name.
        """
        with self._lock:
            self._stepper.go(number)
            branch = self._stepper.branch()
            branch.answer(object_id, name)
            return _compared(
                f"as if object {object_id} were said to be {name}", branch, steps - number
            )

    def rerun_with(self, kind: str, text: str, steps: int) -> BranchComparison:
        """The whole run with another task or other rules.

        Args:
            kind: 'task' or 'rules'.
            text: Text of the file; includes are refused, since it comes from a page.
            steps: Number of steps of the run.

        Raises:
            VisupError: The text is not valid; every mistake is reported.
        """
        if kind == "task" and _INCLUDE.search(text):
            raise SettingsError(
                "a task that is written here cannot include another file",
                hint="put what it needs into the text, or use `visup replay --task FILE`",
            )
        with self._lock:
            self._stepper.go(0)
            reasoners = self._stepper.agent.reasoners
            changed = (
                with_rules(reasoners, parse_rules(text))
                if kind == "rules"
                else with_tasks(reasoners, (parse_task(text),))
            )
            return _compared(f"other {kind}", self._stepper.branch(reasoners=changed), steps)


def _compared(assumption: str, branch: Stepper, steps: int) -> BranchComparison:
    if steps > 0:
        branch.step(steps)
    return BranchComparison(assumption, branch.compare(), branch.mind.time)
