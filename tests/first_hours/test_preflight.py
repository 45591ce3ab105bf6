"""What cannot come to anything is refused, or warned of, before the first frame."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli import Call
from visup.runs.demo import demo_settings
from visup.runs.inputs.preflight import unrecognisable
from visup.tasks import parse_task

MODELS = demo_settings().models
DOCK = ["--task", "dock"]


def test_a_task_without_models_is_refused_before_the_first_frame(
    visup: Call, clip: Path, tmp_path: Path
) -> None:
    done = visup("watch", clip, *DOCK)
    assert done.code == 2
    assert "task `dock` cannot be followed" in done.err
    assert "--models DB" in done.err
    assert "visup teach" in done.err
    assert not list((tmp_path / "runs").iterdir())


def test_a_sink_that_cannot_be_opened_leaves_no_run_behind(
    visup: Call, clip: Path, tmp_path: Path
) -> None:
    words = ["watch", clip, "--no-video", "--quiet", "--out", tmp_path / "run"]
    assert visup(*words, "--sink", "webhook:").code == 2
    assert visup(*words).code == 0  # the same folder will do


def test_so_is_one_whose_actors_are_none_of_the_models(visup: Call, clip: Path) -> None:
    done = visup("watch", clip, "--task", "inspect", "--models", MODELS)
    assert done.code == 2
    assert "has no model of them" in done.err


def test_an_actor_that_no_model_stands_for_is_warned_of_first(visup: Call, clip: Path) -> None:
    done = visup("watch", clip, *DOCK, "--models", MODELS, "--no-video")
    assert done.out.splitlines()[0] == (
        "It is not known what the actor 'satellite' looks like: the model database has no 'satellite'."
    )


def test_who_says_beforehand_who_is_who_needs_no_models(visup: Call, clip: Path) -> None:
    done = visup("watch", clip, *DOCK, "--answer", "1=arm", "--no-video", "--quiet")
    assert done.code == 1  # the other actor never comes: unknown
    assert not done.err


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        ([], 0, "A run can start."),
        ([*DOCK, "--models", MODELS, "--actor", "satellite=spartan"], 0, "satellite is spartan"),
        ([*DOCK, "--models", MODELS], 0, "warning: It is not known what the actor 'satellite'"),
        (DOCK, 2, "cannot be followed"),
        ([*DOCK, "--actor", "arms=arm"], 2, "no task has an actor called 'arms'"),
        ([*DOCK, "--actor", "arms=arm"], 2, "did you mean 'arm'?"),
        ([*DOCK, "--models", MODELS, "--actor", "arm=spartn"], 2, "did you mean 'spartan'?"),
    ],
)
def test_check_says_whether_a_run_can_begin(
    visup: Call, clip: Path, words: list[object], code: int, told: str
) -> None:
    done = visup("check", clip, *words)
    assert done.code == code
    assert told in done.out + done.err


def test_check_refuses_what_watch_would(visup: Call, tmp_path: Path) -> None:
    (tmp_path / "bad.task").write_text("<t> ::= nonsense(a)")
    assert visup("check", tmp_path / "none.mp4").code == 2
    assert visup("check", tmp_path / "none.mp4", "--task", "bad.task").code == 2


@pytest.mark.parametrize(
    ("declared", "lost"),
    [
        ("", {"a", "b"}),
        ("actor a is red\n", {"b"}),
        ("actor a is mug or cup\n", {"b"}),
        ("actor a is red\nactor b is the leftmost\n", set()),
        ("actor b is part of a\n", {"a", "b"}),
    ],
)
def test_actors_are_recognised_by_models_or_by_what_the_task_says(
    declared: str, lost: set[str]
) -> None:
    task = parse_task(declared + "<t> ::= touching(a, b)")
    assert set(unrecognisable([task], {}, ["cup"])) == lost
