"""`make bench`: runs all evaluations for which data are available."""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

from visup.terminal.console import echo

EVALUATIONS = (
    ("shapes", "shapes/kimia99"),
    ("shapes", "shapes/mpeg7-half"),
    ("views", "models"),
    ("scale", "models"),
    ("motion", "missions"),
    ("motion", "video/davis"),
    ("motion", "video/static"),
    ("motion", "video/mot"),
    ("missions", "missions"),
    ("reasoning", "missions"),
    ("health", "video"),
    ("health", "missions"),
)


def main() -> int:
    """Run the evaluations one after another; figures go to the terminal and to JSON files.

    Returns:
        0 if all ran and met their bars, else 1; evaluations without data are skipped.
    """
    parser = argparse.ArgumentParser(description=main.__doc__)
    default_folder = Path.cwd().parent / "shared" / "data"
    parser.add_argument("--data", type=Path, default=default_folder, help="folder with the data")
    parser.add_argument("--out", type=Path, default=Path("runs/bench"), help="folder for JSON")
    parser.add_argument("--only", help="only evaluations whose name contains this")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    # These need no data.
    results = [
        _run(kind, None, arguments.out)
        for kind in (
            "clips",
            "random",
            "robustness",
            "relations",
            "rules",
            "tasks",
            "recognition",
            "faults",
            "resume",
            "hardening",
            "pace",
            "soak",
            "stepping",
        )
        if (arguments.only or "") in kind
    ]
    if not arguments.data.is_dir():
        echo(f"no data at {arguments.data}: nothing else to measure (see --data)")
    results += [
        _run(kind, arguments.data / folder, arguments.out)
        for kind, folder in EVALUATIONS
        if (arguments.only or "") in f"{kind} {folder}" and (arguments.data / folder).is_dir()
    ]
    return int(any(results))


def _run(kind: str, folder: Path | None, out: Path) -> int:
    folder_argument = [] if folder is None else [str(folder)]
    name = kind if folder is None else f"{kind}-{folder.name}"
    json_path = out / f"{name}.json"
    echo(f"== visup eval {name.replace('-', ' ', 1)}")
    start = time.perf_counter()
    # A process each, so that timings do not affect each other.
    command = [
        sys.executable,
        "-m",
        "visup.cli",
        "eval",
        kind,
        *folder_argument,
        "--json",
        str(json_path),
    ]
    code = subprocess.run(command, check=False).returncode
    echo(f"   {time.perf_counter() - start:.0f} s, exit code {code}")
    return code


if __name__ == "__main__":
    sys.exit(main())
