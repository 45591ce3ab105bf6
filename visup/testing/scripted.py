"""Behaviours and sources that do what a script says."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from visup.agent import (
    Behaviour,
    Contract,
    Depth,
    Directive,
    Frame,
    Health,
    HealthStatus,
    Hypothesis,
    Observation,
    Percept,
)
from visup.agent.model.errors import BehaviourError, SettingsError
from visup.percepts.video.source import Ending, VideoSource
from visup.testing.clips import LabelledFrame

Script = Callable[[Frame], object]
"""What is perceived of a frame: one value, or a list of them; None for nothing."""


class Scripted:
    """A behaviour that reports what a function of the frame says.

    Args:
        name: Its name.
        gives: The kinds that it gives; what is said is of the first.
        says: One value, a list of values, or None for nothing.
        declared: Other fields of its contract.
    """

    def __init__(self, name: str, gives: tuple[str, ...], says: Script, **declared: Any) -> None:
        self.contract = Contract(name, gives, **declared)
        self.says = says
        self.directives: list[tuple[Directive, ...]] = []

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report what the script says about one frame, and record the directives for inspection."""
        self.directives.append(tuple(directives))
        value = self.says(frame)
        values = value if isinstance(value, list) else [] if value is None else [value]
        return [self.contract.percept(frame, item) for item in values]


class ScriptedSource(VideoSource):
    """A source of frames that are given.

    Args:
        frames: At least one.
        fps: Frames per second that it announces.
        problem: Why it breaks off after the last one, one sentence; None when it is complete.

    Raises:
        SettingsError: There is no frame.
    """

    def __init__(
        self, frames: Iterable[Frame], fps: float = 25.0, problem: str | None = None
    ) -> None:
        script = list(frames)
        if not script:
            raise SettingsError("a scripted source has no frames", expected="at least one")
        super().__init__("script", fps=fps, size=script[0].size, frame_count=len(script))
        self._script: Iterator[Frame] = iter(script)
        self._breaks_off = problem

    def _next(self) -> Frame | None:
        frame = next(self._script, None)
        if frame is None and self._breaks_off:
            self._end(Ending.TRUNCATED, self._breaks_off)
        return frame

    def _release(self) -> None:
        self._script = iter(())


def stub_behaviours(
    kinds: Iterable[str],
    shots: Sequence[LabelledFrame],
    provide: Mapping[str, Script] | None = None,
) -> list[Behaviour]:
    """Behaviours that give what others need, from what is true of a clip.

    Args:
        kinds: What is needed.
        shots: The clip.
        provide: What is said of a frame, for kinds that a clip knows nothing of.

    Raises:
        BehaviourError: A kind is not known.
    """
    truth = {shot.frame.index: shot for shot in shots}
    scripts: dict[str, Script] = {
        "region": lambda f: list(truth[f.index].regions),
        "hypothesis": lambda f: [
            Hypothesis(r.id, "disc", 0, 0.9, 0.0, 1.0) for r in truth[f.index].regions
        ],
        "depth": lambda f: [Depth(r.id, "disc", 10.0, 0.5) for r in truth[f.index].regions],
        "health": lambda f: Health(HealthStatus.OK),
        **(provide or {}),
    }
    for kind in kinds:
        if kind not in scripts:
            raise BehaviourError(
                f"the clips have no '{kind}', which the behaviour needs",
                hint=f"say it: provide={{'{kind}': lambda frame: ...}}",
            )
    return [Scripted(f"true_{kind}", (kind,), scripts[kind]) for kind in kinds]
