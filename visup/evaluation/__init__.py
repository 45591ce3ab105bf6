"""Evaluation: the figures of `visup eval`, against ground truth, an oracle or a target.

Rooms, by what is evaluated:

- `motion`: segmentation and tracking (J, F, ghosts, id switches, MOTA, IDF1).
- `shape`: shape retrieval and view recognition.
- `health`: camera faults injected into good video.
- `missions`: the whole supervisor on missions with ground truth.
- `simulation`: percepts simulated from a mission's ground truth, with the errors of real ones.
- `reasoning`: reasoning on missions without perception, relations of boxes.
- `runtime`: resume, speed, memory, stepping.

An evaluation is a function `evaluate_NAME(...)` that returns `{"total": {...}, "items": {name: {...}}}`;
`record` writes that as JSON. Start with `motion/runner.py`; `bench` (`make bench`) runs them all, `oracles`
loads comparisons with slow oracles, which are in `tests/oracles` of a source checkout (`make oracles`).
"""

from visup.evaluation.oracles import oracle
from visup.evaluation.record import write_record

__all__ = ["oracle", "write_record"]
