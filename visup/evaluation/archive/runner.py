"""Runs the requested parts of `visup eval archive`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SettingsError
from visup.archive.lake import Lake
from visup.evaluation.archive.chunking import compare_chunks
from visup.evaluation.archive.exactness import compare_find
from visup.evaluation.archive.kills import compare_killed
from visup.evaluation.archive.large_lake import time_large_lake
from visup.evaluation.archive.scheduling import measure_scheduler
from visup.evaluation.archive.simulated_lake import lake_of_missions
from visup.evaluation.archive.throughput import measure_throughput
from visup.evaluation.figures import Progress, silent
from visup.evaluation.missions.files import mission_folders
from visup.evaluation.missions.runner import mission_database

ROWS_PER_RUN = 1_000


@dataclass(frozen=True, slots=True)
class ArchiveSizes:
    """The sizes of the parts.

    Attributes:
        formulas: Number of random conditions.
        every: Frame stride of simulated missions.
        kills: Kills of workers; a tenth as many of the command with its scheduler.
        clips: Number of short clips for the kills.
        runs: Runs of the large lake.
        frames: Frames per mission for the throughput.
        rounds: Repetitions of the throughput measurement.
        jobs: Jobs of the scheduler.
        workers: Workers of the scheduler.
        watched: Missions processed uncut and in chunks.
    """

    formulas: int = 50
    every: int = 4
    kills: int = 4
    clips: int = 8
    runs: int = 1_000
    frames: int = 100
    rounds: int = 1
    jobs: int = 1_000
    workers: int = 100
    watched: int = 1


@dataclass(slots=True)
class _Evaluation:
    missions: Sequence[Path]
    sizes: ArchiveSizes
    seed: int
    folder: Path
    progress: Progress
    models: Path | None = None
    small_lake: Lake | None = None

    def simulated_lake(self) -> Lake:
        """The lake of simulated runs, created on demand."""
        if self.small_lake is None:
            arguments = self.missions, 1, self.sizes.every, self.progress
            self.small_lake = lake_of_missions(self.folder, *arguments)
        return self.small_lake

    def exact(self) -> Mapping[str, Any]:
        lake, count = self.simulated_lake(), self.sizes.formulas
        return compare_find(lake, count, self.seed, self.folder, self.progress)

    def kills(self) -> Mapping[str, Any]:
        kills = self.sizes.kills
        heads = -(-kills // 10)
        folder = self.folder / "kills"
        return compare_killed(folder, self.sizes.clips, kills, heads, self.seed, self.progress)

    def large(self) -> Mapping[str, Any]:
        runs, folder = self.sizes.runs, self.folder / "large"
        rows = runs * ROWS_PER_RUN
        return time_large_lake(self.simulated_lake(), folder, runs, rows, self.seed, self.progress)

    def throughput(self) -> Mapping[str, Any]:
        folder = self.folder / "throughput"
        folder.mkdir()
        sizes = self.sizes.frames, self.sizes.rounds
        return measure_throughput(folder, self.missions, *sizes, self.progress)

    def scheduler(self) -> Mapping[str, Any]:
        return measure_scheduler(self.sizes.workers, self.sizes.jobs, self.progress)

    def chunks(self) -> Mapping[str, Any]:
        folder, mission_folder = self.folder / "chunks", self.missions[0].parent
        folder.mkdir()
        missions = self.missions[: self.sizes.watched]
        models = self.models or mission_database(mission_folder, missions, folder, self.progress)
        return compare_chunks(folder, missions, models, self.progress)


PARTS: Mapping[str, Callable[[_Evaluation], Mapping[str, Any]]] = {
    "exact": _Evaluation.exact,
    "kills": _Evaluation.kills,
    "large": _Evaluation.large,
    "throughput": _Evaluation.throughput,
    "scheduler": _Evaluation.scheduler,
    "chunks": _Evaluation.chunks,
}


def evaluate_archive(
    folder: Path,
    *,
    part: Sequence[str] | None = None,
    seed: int = 23,
    models: Path | None = None,
    progress: Progress = silent,
    **sizes: int,
) -> dict[str, Any]:
    """Figures of lakes.

    Args:
        folder: Missions from which lakes are created.
        part: Some of `PARTS`; all if none.
        seed: Random seed.
        models: Model database; by default one is built as for `visup eval missions`.
        progress: Shows what is being done.
        sizes: As in `ArchiveSizes`.

    Returns:
        `items` with the figures of each part, `total` with `different`: number of unexpected differences.

    Raises:
        SettingsError: There is no such part, or no mission.
    """
    parts = list(part or PARTS)
    if unknown := sorted({*parts} - {*PARTS}):
        raise SettingsError(
            f"there is no part '{unknown[0]}'", expected=f"some of: {', '.join(PARTS)}"
        )
    missions = mission_folders(folder)
    with tempfile.TemporaryDirectory() as scratch:
        evaluation = _Evaluation(
            missions, ArchiveSizes(**sizes), seed, Path(scratch), progress, models
        )
        items = {name: dict(PARTS[name](evaluation)) for name in parts}
    return {"items": items, "total": {"different": sum(_different(i) for i in items.values())}}


def _different(figures: Mapping[str, Any]) -> int:
    return int(figures.get("different", 0))
