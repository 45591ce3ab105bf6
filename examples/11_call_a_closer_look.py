"""An expensive behaviour runs only when needed: a closer look while two objects are near each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import cv2

from visup.agent import Contract, Directive, Frame, Observation, Percept, ReportState
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent
from visup.testing import crossing


class CloserLook:
    """Tells how sharp the regions are that it is called for."""

    contract = Contract(
        "closer_look", gives=("sharpness",), needs=("region",), awake="exists b: gap(a, b) < 40 px"
    )

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterator[Percept]:
        """One percept for each region of which it was called."""
        called = {d.data["region"] for d in directives if d.kind == "wake"}
        grey = cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY)
        for region in observation.of("region"):
            if region.id in called:
                x, y, w, h = region.bbox
                edges = cv2.Laplacian(grey[y : y + h, x : x + w], cv2.CV_64F)
                yield self.contract.percept(
                    frame, {"region": region.id, "sharpness": edges.var().item()}
                )


def main() -> None:
    """Two discs cross; the closer look is called as they come near."""
    agent = build_agent(WatchSettings("clip"), extra=[CloserLook()])
    before = None
    for shot in crossing(frames=90):
        step = agent.step(shot.frame)
        report = next(r for r in step.reports if r.behaviour == "closer_look")
        if report.state != before:
            seen = [p.value["region"] for p in report.percepts]
            ran = report.state is ReportState.RAN
            print(
                f"{step.time:5.2f} s  {report.state}: {f'regions {seen}' if ran else report.error}"
            )
        before = report.state
    for directive in agent.directives:
        print(directive.reason)
    agent.close()


if __name__ == "__main__":
    main()
