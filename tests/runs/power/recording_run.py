"""A run that is recorded, for `test_power.py`: what it tells goes to a file, as a terminal would have it."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.agent.scripted import Scripted, counting, frames
from visup.agent import Mind, Observation, Outcome
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.storage.atomic import write_atomically
from visup.agent.storage.journal import Journal, JournalLimits
from visup.agent.storage.journal_reader import JOURNAL


def seldom(mind: Mind, observation: Observation) -> Outcome:
    """Tells of every fifth frame."""
    told = counting(mind, observation)
    return told if observation.frame_index % 5 == 0 else Outcome(told.mind)


def main(folder: Path, told: Path, count: int) -> None:
    journal = Journal(folder / JOURNAL, JournalLimits(segment_bytes=20_000))
    agent = Agent([Scripted("eye", ("x",), lambda i: "x" * (i * 37 % 400))], Reasoners((seldom,)))
    with told.open("a") as out:
        for frame in frames(count):
            step = agent.step(frame)
            journal.record(step)
            for event in step.events:
                out.write(f"{event.frame_index}\n")
                out.flush()
            if step.frame_index % 20 == 19:
                write_atomically(folder / "state.bin", f"{step.frame_index}\n".encode() * 5000)
                out.write(f"state {step.frame_index}\n")
                out.flush()
    journal.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
