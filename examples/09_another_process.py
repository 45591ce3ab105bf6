"""A behaviour in its own process: when it hangs it is killed, reported, and restarted."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence

from visup.agent import Contract, Directive, Frame, Observation, Percept
from visup.agent.contract.limits import Limits
from visup.agent.cycle.agent import Agent
from visup.testing import disc


class Fragile:
    """Reports how bright the image is, and hangs at the fifth frame."""

    contract = Contract("fragile", gives=("brightness",), isolate=True, memory_mb=200)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterator[Percept]:
        """One number from 0 to 255, with the process that says so."""
        if frame.index == 5:
            time.sleep(3600)
        yield self.contract.percept(frame, (float(frame.image.mean()), os.getpid()))


if __name__ == "__main__":
    agent, last = Agent([Fragile()], limits=Limits(hang_s=0.5)), ""
    for step in agent.steps(shot.frame for shot in disc(40)):
        (report,) = step.reports
        told = report.error or f"process {report.percepts[0].value[1]}"
        if told != last:
            print(f"{step.time:4.2f} s  {report.state}: {told}")
        last = told
    agent.close()
