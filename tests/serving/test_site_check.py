"""`visup serve check`: every camera is looked at, and what to change is said."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.cli import Call, caller
from tests.clips import moving_disc, write_clip
from visup.agent.model.errors import SettingsError
from visup.runs.inputs.speed import Speed
from visup.runs.settings import RunOptions, WatchSettings
from visup.serving.site.checking import CameraCheck, load_lines
from visup.serving.site.records import ProcessLimits, SiteCamera


@pytest.fixture
def visup(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(monkeypatch, capfd)


@pytest.fixture
def site(tmp_path: Path) -> Path:
    write_clip(tmp_path / "clip.avi", moving_disc(20))
    path = tmp_path / "site.toml"
    path.write_text('[[camera]]\nname = "cell"\nsource = "clip.avi"\n')
    return path


def test_a_valid_site_passes_the_check(visup: Call, site: Path) -> None:
    done = visup("serve", "check", site)
    assert done.code == 0
    assert "camera cell" in done.out
    assert "96 x 72 pixels" in done.out
    assert "frames per second can be processed, 25.0 are requested" in done.out
    assert done.out.splitlines()[-1] == "It can be watched."
    assert not (site.parent / "visup-runs").exists()


def test_every_camera_is_checked_even_if_one_cannot_be_watched(visup: Call, site: Path) -> None:
    more = '[[camera]]\nname = "gone"\nsource = "none.avi"\n'
    blind = '[[camera]]\nname = "blind"\nsource = "clip.avi"\ntasks = ["dock"]\n'
    sunk = '[[camera]]\nname = "sunk"\nsource = "clip.avi"\nsinks = ["pigeon:loft"]\n'
    site.write_text(more + blind + sunk + site.read_text())
    done = visup("serve", "check", site, "--no-speed")
    assert done.code == 2
    assert "camera gone: " in done.err
    assert "there is no such file or folder" in done.err
    assert "task `dock` cannot be followed" in done.err
    assert "'pigeon:loft' cannot be read" in done.err
    assert "3 of 4 cameras cannot be watched: gone, blind, sunk" in done.err
    assert "camera cell\n  source" in done.out


def test_a_store_that_cannot_be_written_is_told(visup: Call, site: Path) -> None:
    (site.parent / "file").write_text("")
    site.write_text('store = "file/runs"\n' + site.read_text())
    done = visup("serve", "check", site, "--no-speed")
    assert done.code == 2
    assert "cannot be written" in done.err


def test_a_file_with_mistakes_is_refused(visup: Call, site: Path) -> None:
    site.write_text(site.read_text() + "pase = 5\n")
    done = visup("serve", "check", site)
    assert done.code == 2
    assert "did you mean 'pace'?" in done.err


def test_the_schema_is_printed(visup: Call) -> None:
    assert '"title": "visup: a site file, version 1"' in visup("serve", "schema").out


def checked(name: str, possible: float, wanted: float) -> CameraCheck:
    limits = ProcessLimits(1000.0, 10.0, 10.0)
    one = SiteCamera(name, WatchSettings(source="0"), RunOptions(), limits, "")
    return CameraCheck(one, (), None, Speed(possible, wanted))


RATES = st.tuples(st.floats(2.0, 100.0), st.floats(0.5, 60.0))


@given(st.lists(RATES, min_size=1, max_size=5), st.integers(1, 8))
def test_the_suggested_paces_fit_the_machine(
    rates: list[tuple[float, float]], processors: int
) -> None:
    checks = [checked(f"c{i}", *rate) for i, rate in enumerate(rates)]
    lines = list(load_lines(checks, processors))
    whole = sum(wanted / possible for possible, wanted in rates)
    assert lines[0] == f"all cameras together use {whole:.1f} of {processors} processors"
    advice = [line for line in lines if "feasible values of pace" in line]
    assert bool(advice) == (whole > 0.8 * processors and len(rates) > 1)
    for line in advice:
        paces = [float(each.split()[1]) for each in line.partition("of pace: ")[2].split(", ")]
        needed = sum(p / possible for p, (possible, _) in zip(paces, rates, strict=True))
        least = sum(0.5 / possible for possible, _ in rates)  # no pace below half a frame a second
        assert needed <= 0.8 * processors + least
        assert all(pace <= max(0.5, wanted) for pace, (_, wanted) in zip(paces, rates, strict=True))


def test_unmeasured_cameras_are_left_out_of_the_total() -> None:
    fault = SettingsError("no")
    limits = ProcessLimits(1000.0, 10.0, 10.0)
    one = SiteCamera("a", WatchSettings(source="0"), RunOptions(), limits, "")
    assert list(load_lines([CameraCheck(one, (), fault, None)], 2)) == []
