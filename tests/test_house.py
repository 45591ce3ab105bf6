"""The folders, packages and links are what the design says."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.paths import ROOT

PARTS = ("agent", "percepts", "rules", "tasks")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def folders_with_init() -> set[str]:
    below = [p.parent for part in PARTS for p in (ROOT / part).rglob("__init__.py")]
    names = {"visup." + ".".join(p.relative_to(ROOT).parts) for p in below}
    own = {p.parent for p in (ROOT / "visup").rglob("__init__.py")}
    return names | {
        ".".join(p.relative_to(ROOT).parts)
        for p in own
        if len(p.relative_to(ROOT).parts) == 1 or p.relative_to(ROOT).parts[1] not in PARTS
    }


def test_no_folder_with_an_init_is_missing_from_packages() -> None:
    assert folders_with_init() == set(PROJECT["tool"]["setuptools"]["packages"])


@pytest.mark.parametrize("part", PARTS)
def test_the_links_lead_to_the_folders(part: str) -> None:
    link = ROOT / "visup" / part
    assert link.is_symlink()
    assert link.readlink() == Path("..") / part


def test_no_file_holds_the_markers_of_a_merge() -> None:
    made = subprocess.run(
        ["git", "grep", "-InE", r"^(<{7}|>{7}|[|]{7})( |$)"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if made.returncode == 128:
        pytest.skip("not a git checkout")
    assert made.stdout == ""


def test_pinned_versions_name_no_registry() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    assert lines
    assert all("==" in line and ":" not in line and "/" not in line for line in lines)


@pytest.mark.parametrize(
    ("command", "seconds"),
    [
        ((sys.executable, "-m", "visup.cli", "--help"), 0.3),
        ((sys.executable, "-c", "import visup"), 0.5),
    ],
)
def test_starting_is_quick(command: tuple[str, ...], seconds: float) -> None:
    """The best of several, of the processor's time, which others that work beside cost little."""

    def best(of: tuple[str, ...]) -> float:
        taken = []
        for _ in range(5):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run(of, check=True, capture_output=True, cwd=ROOT, env=os.environ)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            taken.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        return min(taken)

    busy = best((sys.executable, "-c", "pass")) / 0.02
    assert best(command) < seconds * max(1.0, busy)
