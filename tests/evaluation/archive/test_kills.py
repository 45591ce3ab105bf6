"""Which processes are killed while a lake is filled, and how often."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.evaluation.archive import kills
from visup.evaluation.archive.kills import KILL_TARGETS, RandomKills, write_clips

PROCESS_TREE = ([2, 3], [2, 3, 4, 5, 6])
"""Of a command: its children, which start the workers, and all its descendants."""


class FakeCommand:
    """A process that runs until it is waited for."""

    pid = 1
    ended = False

    def poll(self) -> int | None:
        return 0 if self.ended else None

    def wait(self) -> int:
        self.ended = True
        return 0


@pytest.fixture
def killed(monkeypatch: pytest.MonkeyPatch) -> list[list[int]]:
    groups: list[list[int]] = []
    monkeypatch.setattr(kills, "_process_tree", lambda process: PROCESS_TREE)
    monkeypatch.setattr(kills, "_kill", groups.append)
    return groups


@settings(max_examples=30)
@given(requested=st.tuples(*[st.integers(0, 5)] * 3), seed=st.integers())
def test_each_kind_is_killed_the_requested_number_of_times(
    requested: tuple[int, int, int], seed: int
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        groups: list[list[int]] = []
        patch.setattr(kills, "_process_tree", lambda process: PROCESS_TREE)
        patch.setattr(kills, "_kill", groups.append)
        killer = RandomKills(dict(zip(KILL_TARGETS, requested, strict=True)), 0.0, Random(seed))
        killer.kill_during(FakeCommand())  # type: ignore[arg-type]
        assert (killer.left, tuple(killer.done.values())) == ({}, requested)
        kinds = Counter(
            "heads" if 1 in group else "starters" if {*group} & {*PROCESS_TREE[0]} else "workers"
            for group in groups
        )
        assert kinds == +Counter(dict(zip(KILL_TARGETS, requested, strict=True)))
        assert all(sorted(group) == [1, *PROCESS_TREE[1]] for group in groups if 1 in group)


def test_a_command_without_workers_loses_none(killed: list[list[int]]) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    killer = RandomKills({"workers": 3}, 0.0, Random(1))
    killer.kill_during(ended)
    assert (killed, killer.left) == ([], {"workers": 3})


def test_clips_are_equal_only_for_equal_seed_and_number(tmp_path: Path) -> None:
    folders = [write_clips(tmp_path / str(n), 2, seed) for n, seed in enumerate((1, 1, 2))]
    first, again, other = ([p.read_bytes() for p in sorted(f.iterdir())] for f in folders)
    assert first == again
    assert len({*first, *other}) == 4
