"""What `deploy/` says agrees with what the service does."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from tests.paths import ROOT
from visup.serving.camera_supervisor import KILL_AFTER_S
from visup.serving.site_supervisor import TICK_S

DEPLOY = ROOT / "deploy"


def unit() -> dict[str, str]:
    text = (DEPLOY / "visup-serve.service").read_text(encoding="utf-8")
    pairs = re.findall(r"^(\w+)=(.*)$", text, re.MULTILINE)
    return dict(pairs)


def test_the_service_manager_waits_longer_than_the_service_needs() -> None:
    told = unit()
    assert told["Type"] == "notify"
    assert float(told["WatchdogSec"]) > 100 * TICK_S
    assert float(told["TimeoutStopSec"]) > KILL_AFTER_S + 5.0
    # The processes of cameras are the supervisor's to end.
    assert told["KillMode"] == "mixed"
    assert told["ExecReload"].endswith("-HUP $MAINPID")
    assert told["ExecStart"] == "/opt/visup/bin/visup serve /etc/visup/site.toml"


def test_stored_files_are_where_the_service_may_write() -> None:
    text = (DEPLOY / "visup-serve.service").read_text(encoding="utf-8")
    assert "VISUP_STATE_KEY=/var/lib/visup/" in text
    assert "StateDirectory=visup" in text
    image = (DEPLOY / "Dockerfile").read_text(encoding="utf-8")
    (volume,) = re.findall(r"^VOLUME (\S+)$", image, re.MULTILINE)
    kept = re.findall(r"(?:VISUP_STATE_KEY|NUMBA_CACHE_DIR)=(\S+)", image)
    assert len(kept) == 2
    assert all(Path(volume) in Path(path).parents for path in kept)


def test_the_image_installs_existing_extras() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    image = (DEPLOY / "Dockerfile").read_text(encoding="utf-8")
    (extras,) = re.findall(r"pip install .*'\.\[([\w,]+)\]'", image)
    assert set(extras.split(",")) <= set(project["optional-dependencies"])
