"""The playhead of a page: one cursor for picture, timeline and text."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field

from visup.console.run_view import RunView

Listener = Callable[[], object]
TICK_S = 0.125
"""Interval of updates during playback, seconds."""

SLIDER_STEP = 1e-3
"""Resolution of a slider, share of the run."""

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)


@dataclass(slots=True)
class Playhead:
    """The position of one page in a run.

    Attributes:
        run: The run.
        number: Number of the moment, from 0.
        playing: Whether it plays.
        speed: Playback speed, 1 for real time.
        time: Position, seconds; during playback between two moments.
        panel: Name of the open panel.
        selected: The object that was clicked, or None.
        zone_corners: Corners of a zone that is being drawn, pixels.
        drawing_zone: Whether clicks on the picture draw.
    """

    run: RunView
    number: int = 0
    playing: bool = False
    speed: float = 1.0
    time: float = 0.0
    panel: str = ""
    selected: int | None = None
    zone_corners: list[tuple[float, float]] = field(default_factory=list)
    drawing_zone: bool = False
    _listeners: list[tuple[Listener, str | None]] = field(default_factory=list)
    _growth_listeners: list[Listener] = field(default_factory=list)

    def listen(self, listener: Listener, panel: str | None = None) -> None:
        """Call a listener on every move; with `panel`, only while that panel is open."""
        self._listeners.append((listener, panel))

    def listen_to_growth(self, listener: Listener) -> None:
        """Call a listener whenever more of a live run was read."""
        self._growth_listeners.append(listener)

    def grow(self, run: RunView) -> None:
        """Replace the run by a later view of it; a cursor at its end stays at the end."""
        at_end = self.number >= len(self.run.frames) - 1
        self.run = run
        for listener in self._growth_listeners:
            listener()
        if at_end:
            self.go(len(run.frames) - 1)
        else:
            self._notify()

    def open_panel(self, name: str) -> None:
        """Open another panel and update it."""
        self.panel = name
        self._notify()

    def click(self, x: float, y: float) -> None:
        """Handle a click on the picture, pixels: draw a corner, or choose the smallest object there."""
        if self.drawing_zone:
            self.zone_corners.append((round(x, 1), round(y, 1)))
            self._notify()
            return
        hit = [
            b
            for b in self.run.mind(self.number).present()
            if 0 <= x - b.region.bbox[0] <= b.region.bbox[2]
            and 0 <= y - b.region.bbox[1] <= b.region.bbox[3]
        ]
        smallest = min(hit, key=lambda b: b.region.bbox[2] * b.region.bbox[3], default=None)
        self.select(None if smallest is None else smallest.id)

    def set_zone_corners(self, corners: list[tuple[float, float]] | None = None) -> None:
        """Replace the corners of the zone being drawn; none by default."""
        self.zone_corners = corners or []
        self._notify()

    def select(self, object_id: int | None) -> None:
        """Choose an object, or clear the choice if it was chosen already."""
        self.selected = None if self.selected == object_id else object_id
        self._notify()

    def go(self, number: int) -> None:
        """Move to a moment, or to the nearest existing one."""
        number = min(max(0, number), max(0, len(self.run.frames) - 1))
        changed, self.number = number != self.number, number
        self.time = self.run.times[number] if self.run.times else 0.0
        if changed:
            self._notify()

    def go_to_time(self, seconds: float) -> None:
        """Move to the last moment not after a time."""
        self.go(self.run.moment_at(seconds))

    def go_to_share(self, share: float) -> None:
        """Move to a share of the run, 0 to 1."""
        self.go_to_time(self.run.start + share * (self.run.seconds - self.run.start))

    def drag_to_share(self, share: float) -> None:
        """Follow a slider: as `go_to_share`, but by at least one moment, since the slider is coarser."""
        before, number = self.run.share(self.time), self.number
        self.go_to_share(share)
        if self.number == number and abs(share - before) > SLIDER_STEP / 2:
            self.step(1 if share > before else -1)

    def step(self, by: int) -> None:
        """Move some moments forward or back."""
        self.go(self.number + by)

    def tick(self, seconds: float = TICK_S) -> None:
        """Advance during playback; stops at the end."""
        if not self.playing:
            return
        self.time += seconds * self.speed
        number = self.run.moment_at(self.time)
        if number != self.number:
            self.number = number
            self._notify()
        if self.time >= self.run.seconds:
            self.playing = False
            self._notify()

    def toggle(self) -> None:
        """Play or pause; at the end restart."""
        if not self.playing and self.number >= len(self.run.frames) - 1:
            self.go(0)
        self.playing = not self.playing
        self._notify()

    def next_event(self, forward: bool = True) -> None:
        """Jump to the next or the previous moment with an event."""
        times = sorted({e.time for e in self.run.events})
        here = self.run.times[self.number] if self.run.times else 0.0
        if forward:
            index = bisect_right(times, here + 1e-6)
            found = times[index] if index < len(times) else None
        else:
            index = bisect_left(times, here - 1e-6)
            found = times[index - 1] if index else None
        if found is not None:
            self.go_to_time(found)

    def _notify(self) -> None:
        for listener, panel in self._listeners:
            if panel in (None, self.panel):
                listener()
