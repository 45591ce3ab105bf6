"""Query times of a large lake, in a separate process like a command."""

from __future__ import annotations

import resource
import time
from pathlib import Path
from typing import Any

from visup.archive.finding.search import find, read_search
from visup.archive.joining.manifest import read_manifest
from visup.archive.lake import Lake
from visup.archive.querying.database import LakeDatabase, open_database
from visup.evaluation.archive.synthetic_lake import link_recordings, multiply_lake
from visup.evaluation.figures import Progress

PATTERNS = {
    "named": "converging(arm, satellite) and then touching(arm, satellite)"
    " and then diverging(arm, satellite) within 5 s",
    "anybody": "converging(a, b) and then touching(a, b) and then diverging(a, b) within 5 s",
}
QUERIES = {
    "durations": "SELECT task, stage, count(*) AS runs, median(took) AS median_s,"
    " quantile_cont(took, 0.9) AS p90_s FROM (SELECT run, task, stage, sum(seconds) AS took FROM stages"
    " WHERE status IN ('active', 'progressing', 'paused', 'stalled') GROUP BY ALL) GROUP BY ALL",
    "longest": "SELECT clip, task, stage, seconds FROM stages WHERE status = 'progressing'"
    " ORDER BY seconds DESC LIMIT 20",
    "failures": "SELECT task, stage, count(DISTINCT run) AS runs FROM stages"
    " WHERE status IN ('failing', 'failed') GROUP BY ALL",
}


def time_large_lake(
    small: Lake, folder: Path, runs: int, rows: int, seed: int, progress: Progress
) -> dict[str, Any]:
    """Create a large lake and query it.

    Args:
        small: The lake that is multiplied.
        folder: A folder, new or with the large lake of an earlier call.
        runs: Number of runs.
        rows: Approximate number of rows of relations and events.
        seed: Random seed.
        progress: Shows what is being done.

    Returns:
        `runs`, `partitions`, `gb` on disk; `open_s`; for each pattern `index_NAME_s` (prefilter, warm),
        `possible_NAME` and `scanned_NAME` (share of runs); `find_s` and `find_cpu_s`, including the
        evaluation of these runs, for the pattern with names, warm, on one core; for each question
        `sql_NAME_s`, warm; `memory_mb`, the peak memory.
    """
    if (folder / "lake.json").exists():
        lake = Lake.open(folder)
    else:
        lake, _ = multiply_lake(small, folder, runs, rows, seed, progress)
    progress("asking")
    ((_, figures),) = _measure_in_fresh_process(lake, small)
    sizes = (file.stat().st_size for file in folder.rglob("*.parquet"))
    parts = read_manifest(folder).partitions
    return {"runs": len(lake.runs()), "partitions": len(parts), "gb": sum(sizes) / 1e9, **figures}


def _measure_in_fresh_process(lake: Lake, small: Lake) -> list[tuple[Any, dict[str, Any]]]:
    """Query in a fresh process, to measure its memory."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return [(lake, pool.submit(_measure_queries, lake, small).result())]


def _measure_queries(lake: Lake, small: Lake) -> dict[str, Any]:
    figures: dict[str, Any] = {}
    begin = time.perf_counter()
    with open_database(lake) as database:
        figures["open_s"] = time.perf_counter() - begin
        for name, pattern in PATTERNS.items():
            figures |= _pattern_figures(lake, database, name, pattern)
        for name, sql in QUERIES.items():
            figures[f"sql_{name}_s"] = min(_query_seconds(database, sql) for _ in range(3))
        link_recordings(small, lake, read_search(PATTERNS["named"]).possible_runs(database))
        search_times = [_time_search(lake, database) for _ in range(3)]
    figures["find_s"], figures["find_cpu_s"] = min(search_times)
    # Linux gives kilobytes.
    figures["memory_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return figures


def _time_search(lake: Lake, database: LakeDatabase) -> tuple[float, float]:
    """Elapsed and processor seconds of searching the pattern with names."""
    begin, cpu_begin = time.perf_counter(), time.process_time()
    search = read_search(PATTERNS["named"])
    for _ in find(lake, search, search.possible_runs(database), 0):
        pass
    return time.perf_counter() - begin, time.process_time() - cpu_begin


def _pattern_figures(lake: Lake, database: LakeDatabase, name: str, pattern: str) -> dict[str, Any]:
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        possible = read_search(pattern).possible_runs(database)
        times.append(time.perf_counter() - begin)
    return {
        f"index_{name}_s": min(times),
        f"possible_{name}": len(possible),
        f"scanned_{name}": len(possible) / len(lake.runs()),
    }


def _query_seconds(database: LakeDatabase, sql: str) -> float:
    begin = time.perf_counter()
    database.ask(sql)
    return time.perf_counter() - begin
