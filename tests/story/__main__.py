"""`python -m tests.story FOLDER...`: what breaks a law of one voice, in all clips and runs below the folders.

Recorded runs are reasoned about again, worlds are seen by their masks, and other clips with a brief are
taught from it and watched, which takes minutes for each. The exit code is 1 when anything breaks a law.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.story.voice import Told, breaches
from tests.story.watched import told_of_clip, told_of_run, told_of_world
from visup.agent import VisupError
from visup.agent.storage.journal_reader import JOURNAL
from visup.evaluation.machines.mask_regions import has_masks

SHOWN = 12


def sources(folder: Path) -> Iterator[tuple[Path, Callable[[Path], Told]]]:
    """All that something can be told of below a folder, and how it is told."""
    for path in sorted(folder.rglob(JOURNAL)):
        yield path.parent, told_of_run
    for path in sorted(folder.rglob("brief.json")):
        yield path.parent, told_of_world if has_masks(path.parent) else told_of_clip


def main() -> int:
    """Print how many breaches each source has, and the first of them."""
    broken = 0
    for given in map(Path, sys.argv[1:]):
        for place, watched in sources(given):
            try:
                told = watched(place)
            except VisupError as fault:
                print(f"{place}: left out: {fault}", flush=True)
                continue
            found = breaches(told)
            broken += len(found)
            print(f"{place}: {len(told.lines)} lines, {len(found)} breaches", flush=True)
            for breach in found[:SHOWN]:
                print("   ", breach)
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main())
