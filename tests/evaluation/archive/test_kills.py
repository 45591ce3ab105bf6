"""Who is killed while a lake is filled, and how often."""

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
from visup.evaluation.archive.kills import KINDS, RandomKills, write_clips

FAMILY = ([2, 3], [2, 3, 4, 5, 6])
"""Of a command: who starts workers, and these with the workers."""


class Living:
    """A command that lives until it is killed, and its process."""

    pid = 1
    dead = False

    def poll(self) -> int | None:
        return 0 if self.dead else None

    def wait(self) -> int:
        self.dead = True
        return 0


@pytest.fixture
def killed(monkeypatch: pytest.MonkeyPatch) -> list[list[int]]:
    done: list[list[int]] = []
    monkeypatch.setattr(kills, "_family", lambda process: FAMILY)
    monkeypatch.setattr(kills, "_kill", done.append)
    return done


@settings(max_examples=30)
@given(wanted=st.tuples(*[st.integers(0, 5)] * 3), seed=st.integers())
def test_as_many_of_each_kind_are_killed_as_are_wanted(
    wanted: tuple[int, int, int], seed: int
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        done: list[list[int]] = []
        patch.setattr(kills, "_family", lambda process: FAMILY)
        patch.setattr(kills, "_kill", done.append)
        some = RandomKills(dict(zip(KINDS, wanted, strict=True)), 0.0, Random(seed))
        some.disturb(Living())  # type: ignore[arg-type]
        assert (some.left, tuple(some.done.values())) == ({}, wanted)
        kinds = Counter(
            "heads" if 1 in who else "starters" if {*who} & {*FAMILY[0]} else "workers"
            for who in done
        )
        assert kinds == +Counter(dict(zip(KINDS, wanted, strict=True)))
        assert all(sorted(who) == [1, *FAMILY[1]] for who in done if 1 in who)


def test_a_command_without_workers_loses_none(killed: list[list[int]]) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    some = RandomKills({"workers": 3}, 0.0, Random(1))
    some.disturb(ended)
    assert (killed, some.left) == ([], {"workers": 3})


def test_clips_are_alike_only_where_seed_and_number_are(tmp_path: Path) -> None:
    folders = [write_clips(tmp_path / str(n), 2, seed) for n, seed in enumerate((1, 1, 2))]
    first, again, other = ([p.read_bytes() for p in sorted(f.iterdir())] for f in folders)
    assert first == again
    assert len({*first, *other}) == 4
