"""`python -m tests.narrative FOLDER...`: inconsistent narratives of all clips and runs below the folders.

Recorded runs are replayed, rendered worlds are watched by their masks, and other clips with a brief are
taught from it and watched, which takes minutes for each. The exit code is 1 if there is a violation.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.narrative.consistency import NarratedRun, violations
from tests.narrative.narrated_runs import narrate_clip, narrate_run, narrate_world
from visup.agent import VisupError
from visup.agent.storage.journal_reader import JOURNAL
from visup.evaluation.machines.mask_regions import has_masks

MAX_SHOWN = 12


def sources(folder: Path) -> Iterator[tuple[Path, Callable[[Path], NarratedRun]]]:
    """All runs and clips below a folder, with the function that narrates each."""
    for path in sorted(folder.rglob(JOURNAL)):
        yield path.parent, narrate_run
    for path in sorted(folder.rglob("brief.json")):
        yield path.parent, narrate_world if has_masks(path.parent) else narrate_clip


def main() -> int:
    """Print the number of violations of each source, and the first of them."""
    count = 0
    for root in map(Path, sys.argv[1:]):
        for source, narrate in sources(root):
            try:
                narrated = narrate(source)
            except VisupError as fault:
                print(f"{source}: left out: {fault}", flush=True)
                continue
            found = violations(narrated)
            count += len(found)
            print(f"{source}: {len(narrated.lines)} lines, {len(found)} violations", flush=True)
            for violation in found[:MAX_SHOWN]:
                print("   ", violation)
    return int(count > 0)


if __name__ == "__main__":
    sys.exit(main())
