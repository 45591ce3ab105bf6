"""The evaluation of damaged files detects every kind of failure, and finds none in visup."""

from __future__ import annotations

import os
import random
import signal
import time
from pathlib import Path

import pytest

from tests.oracles.hardening.fuzzing import fuzz
from tests.oracles.hardening.mutations import mutated
from tests.oracles.hardening.runner import evaluate_hardening
from tests.oracles.hardening.subjects import Subject
from visup.agent.model.errors import SettingsError, SourceError

SMALL = ["tasks", "rules", "zones", "settings", "answers", "databases", "states", "pictures"]


def test_damaged_files_are_read_or_refused_within_bounds() -> None:
    figures = evaluate_hardening(count=15, seed=11, races=4, cuts=20, kind=SMALL)
    assert figures["failures"] == []
    assert figures["total"]["files"] == 15 * len(SMALL)
    assert figures["total"]["refused"] > 30
    assert figures["total"]["lost"] == 0
    assert figures["total"]["cuts"] in (0, 20)  # none without a C compiler


def test_journals_of_odd_content_are_read_or_refused() -> None:
    kinds = ["journals", "journals of other content", "resumed journals"]
    figures = evaluate_hardening(count=8, seed=12, races=0, cuts=0, kind=kinds)
    assert figures["failures"] == []


def test_damaged_moving_pictures_are_read_or_refused() -> None:
    kinds = ["signals", "video containers", "MJPEG streams"]
    figures = evaluate_hardening(count=10, seed=13, races=0, cuts=0, kind=kinds)
    assert figures["failures"] == []
    assert all(figures["items"][k]["read"] > 0 for k in kinds)  # damage is not all that is seen


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(SettingsError, match="one of: tasks"):
        evaluate_hardening(count=1, cuts=0, kind=["spoons"])


def misbehave(number: int) -> None:
    match number:
        case 1:
            raise SourceError("refused")
        case 2:
            raise ValueError("a traceback")
        case 3:
            os.abort()
        case 4:
            bytearray(2**32)
        case 5:
            os.system("true")  # noqa: S605
        case 8:
            os._exit(3)


def test_every_kind_of_failure_is_detected(tmp_path: Path) -> None:
    """Without this the tests above could not fail."""

    def make(folder: Path, rng: random.Random) -> None:
        number = len(list(tmp_path.glob("*.n")))
        (folder / "n").write_text(str(number))
        (tmp_path / f"{time.monotonic_ns()}.n").touch()
        if number == 6:
            raise OSError("it cannot be made")
        if number == 7:
            signal.raise_signal(signal.SIGALRM)  # the time is over when all is done

    subject = Subject(make, lambda folder: misbehave(int((folder / "n").read_text())))
    result = fuzz(subject, 9, 0, tmp_path)
    assert result.outcomes == {
        "read": 1, "refused": 1, "raised": 2, "crashed": 2, "memory": 1, "ran": 1, "slow": 1
    }  # fmt: skip
    assert len(result.failures) == 7
    failures = "\n".join(result.failures)
    assert "3: crashed by SIGABRT" in failures
    assert "8: crashed with the exit code 3" in failures
    assert "it cannot be made" in failures


def test_mutations_depend_only_on_the_seed() -> None:
    seeds = [b"gap(a, b) < 20 px", b"0123456789" * 9]
    first, second = ([mutated(seeds, random.Random(n)) for n in range(200)] for _ in range(2))
    assert first == second
    assert len(set(first)) > 150
