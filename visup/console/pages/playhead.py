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
        chosen: The object that was clicked, or None.
        drawn: Corners of a zone that is being drawn, pixels.
        pen: Whether clicks on the picture draw.
    """

    run: RunView
    number: int = 0
    playing: bool = False
    speed: float = 1.0
    time: float = 0.0
    panel: str = ""
    chosen: int | None = None
    drawn: list[tuple[float, float]] = field(default_factory=list)
    pen: bool = False
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

    def point(self, x: float, y: float) -> None:
        """Handle a click on the picture, pixels: draw a corner, or choose the smallest object there."""
        if self.pen:
            self.drawn.append((round(x, 1), round(y, 1)))
            self._notify()
            return
        here = [
            b
            for b in self.run.mind(self.number).present()
            if 0 <= x - b.region.bbox[0] <= b.region.bbox[2]
            and 0 <= y - b.region.bbox[1] <= b.region.bbox[3]
        ]
        smallest = min(here, key=lambda b: b.region.bbox[2] * b.region.bbox[3], default=None)
        self.choose(None if smallest is None else smallest.id)

    def draw(self, corners: list[tuple[float, float]] | None = None) -> None:
        """Replace the corners of the zone being drawn; none by default."""
        self.drawn = corners or []
        self._notify()

    def choose(self, object_id: int | None) -> None:
        """Choose an object, or clear the choice if it was chosen already."""
        self.chosen = None if self.chosen == object_id else object_id
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
        self.go(self.run.at(seconds))

    def go_to_share(self, share: float) -> None:
        """Move to a share of the run, 0 to 1."""
        self.go_to_time(self.run.start + share * (self.run.seconds - self.run.start))

    def pull(self, share: float) -> None:
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
        number = self.run.at(self.time)
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

    def next_event(self, forth: bool = True) -> None:
        """Jump to the next or the previous moment with an event."""
        times = sorted({e.time for e in self.run.events})
        here = self.run.times[self.number] if self.run.times else 0.0
        if forth:
            at = bisect_right(times, here + 1e-6)
            found = times[at] if at < len(times) else None
        else:
            at = bisect_left(times, here - 1e-6)
            found = times[at - 1] if at else None
        if found is not None:
            self.go_to_time(found)

    def _notify(self) -> None:
        for listener, panel in self._listeners:
            if panel in (None, self.panel):
                listener()
