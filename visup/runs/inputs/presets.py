"""Presets: rules, memory times and frame rates for kinds of scenes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import SettingsError
from visup.rules.presence import ObjectSettings


@dataclass(frozen=True, slots=True)
class Preset:
    """Settings for a kind of scene, each with its reason, which `visup presets` prints.

    Attributes:
        name: As it is typed.
        about: Its scenes.
        without: Shipped rules that are switched off.
        rules_because: Reason for that.
        objects: How long objects are remembered.
        memory_because: Reason for that.
        enough_fps: Least frame rate to which faster sources are thinned out; None for all frames.
        pace_because: Reason for that.
    """

    name: str
    about: str
    without: frozenset[str]
    rules_because: str
    objects: ObjectSettings
    memory_because: str
    enough_fps: float | None
    pace_because: str

    def every(self, fps: float) -> int:
        """Use every n-th frame of a source: n.

        >>> PRESETS["traffic"].every(30.0), PRESETS["traffic"].every(10.0), PRESETS["cell"].every(60.0)
        (2, 1, 1)
        """
        return 1 if self.enough_fps is None else every_for(self.enough_fps, fps)


def every_for(enough_fps: float, fps: float) -> int:
    """The n for using every n-th frame, if a given rate is enough.

    >>> every_for(5.0, 25.0), every_for(5.0, 24.0), every_for(5.0, 3.0)
    (5, 4, 1)
    """
    return max(1, int(fps / enough_fps + 1e-6))


_MEETING = frozenset({"collision_course", "doubtful_collision", "contact"})

PRESETS: Mapping[str, Preset] = MappingProxyType(
    {
        p.name: p
        for p in (
            Preset(
                "traffic",
                "a road, a yard or a square, seen by a fixed camera",
                _MEETING | {"excessive_spin", "doubtful_object"},
                "outlines of vehicles and people that pass each other meet all the time, which means "
                "nothing; zones that must stay empty, and the camera itself, are still watched",
                ObjectSettings(forget_left_s=5.0, forget_hidden_s=60.0, forget_nameless_s=5.0),
                "whoever has left does not come back; the next one is somebody else",
                15.0,
                "what crosses the picture in two seconds is still seen in thirty frames",
            ),
            Preset(
                "cell",
                "a robot at work on parts; people may come near",
                frozenset({"doubtful_collision", "excessive_spin"}),
                "contact between known things that no task asks for is an alarm; unknown things are left to "
                "tasks and zones",
                ObjectSettings(forget_nameless_s=60.0),
                "a gripper may hide a part for a minute, and it is still the same part",
                None,
                "a contact may show in a single frame",
            ),
            Preset(
                "orbit",
                "spacecraft that approach, dock and are captured",
                frozenset(),
                "anything that approaches, spins or enters matters",
                ObjectSettings(forget_nameless_s=120.0),
                "what an arm or a panel hides may reappear minutes later",
                10.0,
                "bodies drift by a tenth of a pixel a frame, so fewer frames show the motion just as well",
            ),
            Preset(
                "bench",
                "hands and things on a table",
                _MEETING | {"excessive_spin", "doubtful_object"},
                "hands touch and turn everything; that is the work",
                ObjectSettings(forget_nameless_s=30.0),
                "a hand may hide what it holds for half a minute",
                15.0,
                "fifteen frames a second are enough to follow hands at work",
            ),
        )
    }
)
"""By name."""


def preset_named(name: str) -> Preset:
    """A preset.

    Raises:
        SettingsError: There is none of that name.
    """
    if name not in PRESETS:
        raise SettingsError(
            f"there is no preset '{name}'",
            expected=f"one of: {', '.join(PRESETS)}",
            hint=did_you_mean(name, PRESETS),
        )
    return PRESETS[name]
