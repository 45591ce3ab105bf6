"""The public API: names at the root, results of runs, and tables."""

from __future__ import annotations

import ast
import subprocess
import sys
from io import StringIO
from pathlib import Path

import cv2
import numpy as np
import pytest
from rich.console import Console

import visup
from tests.paths import ROOT
from visup.agent.model.errors import ExtraMissingError, SettingsError, SourceError
from visup.api.recorded import RecordedStep
from visup.api.records import Records, columns
from visup.runs.demo import demo_settings
from visup.testing import crossing

FRAMES = 30


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("clip")
    for number, shot in enumerate(crossing(FRAMES)):
        cv2.imwrite(str(folder / f"{number:04}.png"), shot.frame.image)
    return folder


@pytest.fixture(scope="module")
def recorded(clip: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[visup.Run, Path]:
    folder = tmp_path_factory.mktemp("run") / "run"
    return visup.watch(clip, fps=25, out=folder).finish(), folder


def declared() -> set[str]:
    """The names that type checkers and editors see at the root."""
    tree = ast.parse((ROOT / "visup" / "__init__.py").read_text())
    guarded = next(node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in guarded.body if isinstance(node, ast.ImportFrom)]
    return {alias.asname or alias.name for node in imports for alias in node.names}


def test_every_public_name_is_declared_and_listed() -> None:
    assert declared() == set(visup.__all__)
    assert all(getattr(visup, name) is not None for name in visup.__all__)
    assert set(visup.__all__) <= set(dir(visup))


def test_an_unknown_name_gives_the_usual_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'visup' has no attribute 'wach'"):
        visup.wach  # noqa: B018


def test_importing_visup_loads_nothing_heavy() -> None:
    code = "import sys, visup; print([m for m in ('numpy', 'cv2', 'numba', 'rich') if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_a_run_advances_by_iteration_and_steps_carry_frames(clip: Path) -> None:
    with visup.watch(clip, fps=25) as run:
        first, second = next(run), next(run)
        assert first.frame is not None
        assert (first.frame_index, second.frame_index) == (0, 1)
        assert [s.frame_index for s in run.steps] == [0, 1]
        assert run.result is None
    assert run.result is not None
    assert run.result.problem == "stopped by the user"
    assert list(run) == []


def test_asking_for_results_first_watches_the_whole_source(clip: Path) -> None:
    run = visup.watch(clip, fps=25)
    assert run.verdict is None
    assert len(run.steps) == FRAMES
    assert run.result is not None
    assert run.result.steps == FRAMES


def test_only_the_last_stored_step_carries_its_frame(recorded: tuple[visup.Run, Path]) -> None:
    run, _ = recorded
    assert run.steps[-1].draw().shape == (120, 160, 3)
    with pytest.raises(SettingsError, match="does not carry its image"):
        run.steps[0].draw()


def test_a_picture_is_the_frame_with_beliefs_drawn_over_it(clip: Path) -> None:
    step = [s for s in visup.watch(clip, fps=25) if s.mind.objects][-1]
    assert step.frame is not None
    picture = step.draw()
    assert picture.dtype == np.uint8
    assert picture.shape == step.frame.image.shape
    assert (picture != step.frame.image).any()
    other = visup.Frame(step.frame_index + 1, 0.0, step.frame.image)
    with pytest.raises(SettingsError, match="was given to draw the step of"):
        step.draw(other)


def test_a_recorded_run_has_the_records_of_the_run(
    recorded: tuple[visup.Run, Path],
) -> None:
    run, folder = recorded
    again = visup.open_run(folder)
    assert [e.text for e in again.events] == [e.text for e in run.events]
    assert [(s.frame_index, s.time) for s in again.steps] == [
        (s.frame_index, round(s.time, 6)) for s in run.steps
    ]
    believed = [(s.frame_index, i) for s in run.steps for i in sorted(s.mind.objects)]
    assert [(o.frame_index, o.id) for o in again.objects] == believed
    assert again.settings.source == run.settings.source
    assert again.verdict is run.verdict
    assert len(again.events) > 0


def test_columns_do_not_depend_on_the_number_of_records(
    recorded: tuple[visup.Run, Path],
) -> None:
    pytest.importorskip("pyarrow", reason="the extra visup[tables] is not installed")
    run = visup.open_run(recorded[1])
    for records in (run.events, run.alerts, run.steps, run.objects):
        names = list(columns(records.kind))
        full, empty = records.to_arrow(), records[:0].to_arrow()
        assert full.column_names == list(records.to_pandas().columns) == names
        assert full.num_rows == len(records) == len(records.to_pandas())
        assert empty.schema == full.schema
    assert "data" in columns(visup.Event)
    assert run.objects.to_arrow()["time"].to_pylist() == [o.time for o in run.objects]


def test_a_table_without_its_library_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ExtraMissingError, match="extra 'tables'"):
        Records(RecordedStep, [RecordedStep(0, 0.0)]).to_pandas()


def test_runs_and_records_have_displays(recorded: tuple[visup.Run, Path]) -> None:
    run, folder = recorded
    again = visup.open_run(folder)
    assert '<img alt="' in run._repr_html_()
    assert "data:image/png;base64," in run.steps[-1]._repr_html_()  # type: ignore[attr-defined]
    assert "nothing unsafe was seen" in again._repr_html_()
    console = Console(width=100, record=True, force_terminal=True, file=StringIO())
    console.print(run, again.objects, again)
    text = console.export_text()
    assert "\u2580" in text
    assert f"{len(again.objects)} records of RecordedObject" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"source": "nowhere.mp4"}, "there is no such file"),
        ({"source": None}, "a source cannot be None"),
        ({"source": "x", "evry": 2}, "there is no setting called 'evry'"),
        ({"source": "x", "every": "often"}, "the setting 'every' cannot be 'often'"),
        ({"source": "x", "every": 0}, "every is 0"),
        ({"source": "x", "task": 3}, "the task to verify cannot be 3"),
        ({"source": "x", "models": 3}, "the model database cannot be 3"),
        ({"source": "x", "actors": {"arm": ()}}, "the actor 'arm' cannot stand for ()"),
        ({"source": "x", "actors": "arm"}, "actors cannot be 'arm'"),
        ({"source": visup.Settings("x"), "every": 2}, "a Settings object is complete"),
    ],
)
def test_bad_input_is_explained(arguments: dict[str, object], message: str) -> None:
    with pytest.raises((SettingsError, SourceError)) as caught:
        visup.watch(**arguments)  # type: ignore[arg-type]
    assert message in str(caught.value)


def test_a_task_that_was_loaded_can_be_verified(clip: Path) -> None:
    models = demo_settings().models  # any that has the actors' names
    run = visup.watch(clip, fps=25, task=visup.load_task("dock"), models=models)
    assert run.settings.tasks == ("dock:dock",)
    assert next(run).mind.tasks[0].task == "dock"
    run.stop()
