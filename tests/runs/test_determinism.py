"""The same input gives the same bytes: twice, and however many cores there are."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from visup.agent.storage.codec import pack_observation
from visup.agent.storage.journal_reader import Recording

EVERY = 6
UNTIL_S = 3.0
"""Seconds of the clip: both actors are recognised, and the first stage progresses. What is perceived is
compared to the last bit, of which events show little."""

RUN = """
import os, sys
from pathlib import Path
cores = [int(c) for c in sys.argv[2].split(",")]
os.sched_setaffinity(0, cores)
from visup.runs.demo import demo_settings
from visup.runs.runner import Audience, supervise
from visup.runs.settings import RunOptions

def stop(step, frame):
    if step.time >= float(sys.argv[4]):
        raise KeyboardInterrupt

folder = Path(sys.argv[1])
folder.mkdir()
options = RunOptions(video=False, report=False)
supervise(demo_settings(int(sys.argv[3])), folder, audience=Audience([stop]), options=options)
"""


def told(folder: Path, cores: list[int]) -> tuple[bytes, list[bytes], list[object]]:
    """The events, all that was perceived, and what was believed of it."""
    # As many threads as there are cores.
    one_thread = ("OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
    env = {k: v for k, v in os.environ.items() if k not in one_thread}
    subprocess.run(
        [
            *(sys.executable, "-c", RUN, str(folder)),
            *(",".join(map(str, cores)), str(EVERY), str(UNTIL_S)),
        ],
        check=True,
        env=env,
    )
    run = Recording.open(folder)
    observations = list(run.observations())
    assert any(o.of("hypothesis") for o in observations)
    seen = [pack_observation(o) for o in observations]
    return (folder / "events.jsonl").read_bytes(), seen, list(run.summaries())


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="cores cannot be chosen here")
def test_journal_and_events_are_identical_on_one_core_and_on_all(
    tmp_path: Path,
) -> None:
    cores = sorted(os.sched_getaffinity(0))
    one = told(tmp_path / "one", cores[:1])
    assert one[0].count(b'"identified"') == 2
    assert b'"stage_progressing"' in one[0]
    assert told(tmp_path / "all", cores) == one
