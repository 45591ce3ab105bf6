"""The site file: what it says is what is watched; what is wrong with it is told by line."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel

from tests.docs.blocks import blocks
from tests.paths import ROOT
from visup.agent.model.errors import ErrorGroup, SettingsError, SourceLocation, VisupError
from visup.runs.settings import WatchSettings
from visup.serving.site.form import CameraTable, SiteTable, schema_text
from visup.serving.site.reading import read_site
from visup.serving.site.records import SiteCamera

ONE = '[[camera]]\nname = "cell"\nsource = "clip.avi"\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "site.toml"
    path.write_text(text)
    return path


def camera(folder: Path, text: str, **environment: str) -> SiteCamera:
    (only,) = read_site(written(folder, text), environment).cameras
    return only


def faults(folder: Path, text: str) -> list[VisupError]:
    with pytest.raises(VisupError) as caught:
        read_site(written(folder, text), {})
    found = caught.value
    return list(found.errors) if isinstance(found, ErrorGroup) else [found]


def test_every_key_reaches_the_settings_of_the_run(tmp_path: Path) -> None:
    text = f"""
store = "runs"
sinks = ["file:alerts.jsonl"]
[recording]
video = true
keep_gb = 3.0
state_every = 5.0
[limits]
memory_mb = 500.0
{ONE}
tasks = ["dock", "own.task:part"]
models = "cell.models"
actors = {{ arm = "rms", satellite = ["spartan", "hubble"] }}
bystanders = ["cart"]
rules = ["own.rules"]
zones = "zones.toml"
signals = ["table.csv", "mqtt:broker/topic"]
behaviours = ["lamp.py", "package.module:Lamp"]
preset = "cell"
pace = 5.0
fov = 40.0
rest_s = 2.0
sinks = ["webhook:https://example.org/hook", "file:alerts.jsonl"]
"""
    one = camera(tmp_path, text)
    assert one.settings == WatchSettings(
        source=str(tmp_path / "clip.avi"),
        tasks=("dock", str(tmp_path / "own.task:part")),
        models=tmp_path / "cell.models",
        actors={"arm": ("rms",), "satellite": ("spartan", "hubble")},
        bystanders=("cart",),
        rules=(tmp_path / "own.rules",),
        zones=tmp_path / "zones.toml",
        signals=(tmp_path / "table.csv", "mqtt:broker/topic"),
        behaviours=(tmp_path / "lamp.py", "package.module:Lamp"),
        preset="cell",
        pace=5.0,
        fov_vertical_deg=40.0,
        rest_s=2.0,
    )
    assert one.options.sinks == (
        f"file:{tmp_path / 'alerts.jsonl'}",
        "webhook:https://example.org/hook",
    )
    assert (one.options.video, one.options.keep_gb, one.options.state_every_s) == (True, 3.0, 5.0)
    assert one.limits.memory_mb == 500.0


@pytest.mark.parametrize(
    ("written_as", "read_as"),
    [
        ("0", "0"),
        ("rtsp://cell/1", "rtsp://cell/1"),
        ("clip.avi", "{folder}/clip.avi"),
        ("loop:clip.avi", "loop:{folder}/clip.avi"),
        ("/clips/a.avi", "/clips/a.avi"),
        ("rtsp://guard:${PASSWORD}@cell/1", "rtsp://guard:swordfish@cell/1"),
        ("rtsp://guard:${file:word.txt}@cell/1", "rtsp://guard:marlin@cell/1"),
    ],
)
def test_sources_are_parsed(tmp_path: Path, written_as: str, read_as: str) -> None:
    (tmp_path / "word.txt").write_text("marlin\n")
    text = ONE.replace("clip.avi", written_as)
    found = camera(tmp_path, text, PASSWORD="swordfish").settings.source
    assert found == read_as.replace("{folder}", str(tmp_path))


@pytest.mark.parametrize(
    ("text", "line", "told"),
    [
        (ONE + 'taks = ["dock"]', 4, "did you mean 'tasks'?"),
        ("[retention]\ndayz = 3\n" + ONE, 2, "did you mean 'days'?"),
        ('[monitoring]\nlisten = "9464"\n' + ONE, 2, "ADDRESS:PORT"),
        ('[evidence]\nlink = "ftp://cell"\n' + ONE, 2, "an http or https address"),
        (ONE + 'quiet = ["10-12"]', 1, "22:00-06:00"),
        ('timezone = "Mars/Olympus"\n' + ONE, 2, "such as Europe/Berlin"),
        (ONE + 'preset = "cel"', 4, "one of: traffic, cell, orbit, bench"),
        (ONE + "pace = 0", 4, "camera.pace cannot be 0"),
        (ONE + 'tasks = "dock"', 4, "a list of texts"),
        (ONE + "actors = { arm = 3 }", 4, "a text or a list of texts"),
        (ONE + "attention = 1", 4, "true or false"),
        ('[[camera]]\nname = "a b"\nsource = "0"', 2, "letters, digits"),
        ('[[camera]]\nname = ".."\nsource = "0"', 2, "letters, digits"),
        ('[[camera]]\nname = "a"', 1, "'source' is missing"),
        (ONE + ONE.replace("cell", "CELL"), 5, "two cameras are called 'CELL'"),
        ("[limits]\nmemory = 3\n" + ONE, 2, "memory_mb"),
        (f'[console]\nlisten = "8086"\ntoken = "{"t" * 20}"\n' + ONE, 2, "ADDRESS:PORT"),
        ('[console]\nlisten = "127.0.0.1:8086"\n' + ONE, 1, "'token' is missing"),
        ('[console]\nlisten = "127.0.0.1:8086"\ntoken = "short"\n' + ONE, 1, "too short"),
        (f'[console]\nlisten = "a:8086"\ntoken = "{"t" * 20}"\nname = "a"\n' + ONE, 4, "'names'"),
        ("[[camera]", 1, "this is not TOML"),
        (ONE.replace("clip.avi", "rtsp://${NONE}/"), 1, "has no variable NONE"),
        (ONE.replace("clip.avi", "rtsp://${file:none}/"), 1, "cannot be read"),
        (ONE.replace("clip.avi", "rtsp://${a b}/"), 1, "cannot be replaced"),
    ],
)
def test_a_mistake_is_reported_with_its_line(
    tmp_path: Path, text: str, line: int, told: str
) -> None:
    (fault,) = faults(tmp_path, text)
    assert isinstance(fault.where, SourceLocation)
    assert fault.where.line == line
    assert told in str(fault)


def test_all_mistakes_are_reported_together_in_order(tmp_path: Path) -> None:
    found = faults(tmp_path, "stor = 1\n[limits]\nmemory_mb = 'x'\n[[camera]]\nsource = 3\n")
    lines = [f.where.line for f in found if isinstance(f.where, SourceLocation)]
    assert lines == [1, 3, 4, 5]


@pytest.mark.parametrize("text", ["", 'store = "x"', "camera = []"])
def test_a_site_needs_a_camera(tmp_path: Path, text: str) -> None:
    assert '[[camera]], name = "cell"' in str(faults(tmp_path, text)[0])


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="cannot be read"):
        read_site(tmp_path / "none.toml")


def test_the_fingerprint_covers_files_but_no_password(tmp_path: Path) -> None:
    (tmp_path / "own.rules").write_text("one")
    text = ONE.replace("clip.avi", "rtsp://guard:${WORD}@cell/1") + 'rules = ["own.rules"]\n'
    first = camera(tmp_path, text, WORD="marlin")
    other_word = camera(tmp_path, text, WORD="swordfish")
    assert other_word.fingerprint == first.fingerprint
    assert other_word != first
    sunk = camera(tmp_path, 'sinks = ["jsonl:-"]\n' + text, WORD="marlin")
    assert sunk.fingerprint == first.fingerprint
    assert sunk != first
    (tmp_path / "own.rules").write_text("two")
    changed = camera(tmp_path, text, WORD="marlin")
    assert changed.fingerprint != first.fingerprint
    assert changed == replace(first, fingerprint=changed.fingerprint)


def test_keys_of_webhooks_come_from_the_environment(tmp_path: Path) -> None:
    head = '[webhooks]\nkey = "${KEY}"\nheaders = { Authorization = "Bearer ${TOKEN}" }\n'
    one = camera(tmp_path, head + ONE, KEY="swordfish", TOKEN="marlin")
    assert one.options.webhook_key == "swordfish"
    assert one.options.webhook_headers == {"Authorization": "Bearer marlin"}
    assert "marlin" not in repr(one)
    (fault,) = faults(tmp_path, head + ONE)
    assert "has no variable" in str(fault)


def test_tokens_of_the_console_come_from_the_environment(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    head = (
        '[console]\nlisten = "0.0.0.0:8086"\ntoken = "${TOKEN}"\nnames = ["cell.example"]\n'
        'save_to = "own"\n'
    )
    site = read_site(written(tmp_path, head + ONE), {"TOKEN": "swordfish-and-marlin"})
    assert site.console is not None
    assert site.console.listen == ("0.0.0.0", 8086)
    assert site.console.token == "swordfish-and-marlin"
    assert site.console.names == ("cell.example",)
    assert site.console.save_to == tmp_path.resolve() / "own"
    assert "swordfish" not in repr(site)
    assert read_site(written(tmp_path, ONE)).console is None


def test_the_schema_knows_every_key_of_a_camera() -> None:
    form = json.loads(schema_text())
    keys = form["$defs"]["CameraTable"]["properties"]
    assert {"name", "source", "tasks", "models", "actors", "zones", "rules", "pace"} <= set(keys)
    assert all("description" in key for key in keys.values())
    assert form["$defs"]["CameraTable"]["required"] == ["name", "source"]


def test_the_documentation_has_every_key_and_a_valid_example(tmp_path: Path) -> None:
    page = ROOT / "docs" / "serving.md"
    text = page.read_text(encoding="utf-8")
    given = [kind.annotation for kind in SiteTable.model_fields.values()]
    tables = [one for kind in given for one in (kind, *get_args(kind))]
    own = [t for t in tables if isinstance(t, type) and issubclass(t, BaseModel)]
    assert len(own) >= 7
    every: list[type[BaseModel]] = [SiteTable, CameraTable, *own]
    for table in every:
        assert [key for key in table.model_fields if not re.search(rf"[`\[]{key}[`\]]", text)] == []
    block, *_ = (b for b in blocks() if b.page == page and b.kind == "toml")
    example = block.text.replace("/run/secrets/cell", "secret.txt")
    (tmp_path / "secret.txt").write_text("marlin")
    site = read_site(written(tmp_path, example), {"ALARM_URL": "https://example.org/alarms"})
    assert [c.name for c in site.cameras] == ["cell", "yard"]
