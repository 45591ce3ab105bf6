"""Write your own behaviour: report a lamp, a spot much brighter than the rest of the image.

Run it by itself, or give the file to `visup watch CLIP --behaviour examples/04_own_behaviour.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from visup.agent import Contract, Directive, Frame, Observation, Percept
from visup.agent.cycle.agent import Agent
from visup.runs.demo import demo_settings
from visup.runs.wiring import open_video


class Lamp:
    """Reports where the brightest spot is, when it stands out."""

    contract = Contract("lamp", gives=("lamp",), every_s=0.2)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterator[Percept]:
        """One percept, (x, y) in pixels, when a spot is over 100 grey levels above the mean."""
        grey = frame.image.mean(axis=2)
        y, x = divmod(int(grey.argmax()), grey.shape[1])
        contrast = float(grey[y, x] - grey.mean())
        if contrast > 100:
            yield Percept("lamp", (x, y), frame.time, "lamp", confidence=min(contrast / 200, 1.0))


if __name__ == "__main__":
    with open_video(demo_settings()) as source:
        for step in Agent([Lamp()]).steps(source):
            for x, y in step.observation.of("lamp"):
                print(f"{step.time:5.1f} s  a lamp at ({x}, {y})")
            if step.time > 2:
                break
