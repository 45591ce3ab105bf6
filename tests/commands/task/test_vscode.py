"""The extension for VS Code: its script builds it, and a headless run with it finds and mends a mistake."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.paths import ROOT

FOLDER = ROOT / "editors" / "vscode"


def build(folder: Path) -> Path:
    script = [sys.executable, str(FOLDER / "build.py"), str(folder)]
    done = subprocess.run(script, check=True, capture_output=True, text=True)
    return Path(done.stdout.strip())


def test_the_build_has_every_file_of_the_package(tmp_path: Path) -> None:
    with zipfile.ZipFile(build(tmp_path)) as archive:
        names = set(archive.namelist())
        package = json.loads(archive.read("extension/package.json"))
        grammars = package["contributes"]["grammars"]
        scopes = {
            g["scopeName"]: json.loads(archive.read(f"extension/{g['path'].removeprefix('./')}"))[
                "scopeName"
            ]
            for g in grammars
        }
    assert {"[Content_Types].xml", "extension.vsixmanifest", "extension/extension.js"} <= names
    assert all(scope == declared for scope, declared in scopes.items())
    extensions = {e for k in package["contributes"]["languages"] for e in k["extensions"]}
    assert extensions == {".task", ".rules"}


def test_the_build_is_reproducible(tmp_path: Path) -> None:
    first = build(tmp_path).read_bytes()
    assert build(tmp_path).read_bytes() == first


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node to run the extension in")
def test_a_headless_run_finds_and_fixes_a_mistake(tmp_path: Path) -> None:
    pytest.importorskip("pygls", reason="the extra `lsp` is not installed")
    with zipfile.ZipFile(build(tmp_path)) as archive:
        archive.extractall(tmp_path)
    command = tmp_path / "visup"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m visup.cli "$@"\n')
    command.chmod(0o755)
    run = ["node", str(FOLDER / "headless.js"), str(tmp_path / "extension"), str(command)]
    done = subprocess.run(
        run, check=False, capture_output=True, text=True, timeout=60, cwd=ROOT, env=os.environ
    )
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert "unknown action `cupled`" in report["message"]
    assert report["fix"] == "coupled"
    assert report["tokens"] == 20  # four names: stage, action, two actors
    assert report["providers"] == 12
