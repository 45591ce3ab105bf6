"""The state shared by all pages."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.archive.recordings import meeting, record
from tests.console.test_runs import SETTINGS
from visup.agent.model.errors import ErrorGroup, OutputError, SourceLocation, TaskError
from visup.console import state
from visup.console.library import RunLibrary
from visup.console.state import ConsoleState

SECRET = TaskError("unexpected word", where=SourceLocation("/etc/keys", 1, 1, "swordfish", 9))


@pytest.mark.parametrize("fault", [SECRET, ErrorGroup([SECRET, SECRET])])
def test_errors_quote_no_line_of_files_that_a_run_names(
    fault: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(folder: Path) -> None:
        raise fault

    monkeypatch.setattr(state, "Inquiry", refuse)
    with pytest.raises(OutputError) as caught:
        state._open_inquiry(tmp_path)
    assert "swordfish" not in str(caught.value)
    assert "/etc" not in str(caught.value)


def test_a_run_that_replaces_another_is_read_again(tmp_path: Path) -> None:
    record(tmp_path / "runs" / "a", meeting(30), SETTINGS)
    shared = ConsoleState(RunLibrary([tmp_path / "runs"]))
    (entry,) = shared.library.scan()
    assert len(shared.view(entry.key).frames) == 30
    (tmp_path / "runs" / "a").rename(tmp_path / "old")
    record(tmp_path / "runs" / "a", meeting(12), SETTINGS)
    assert len(shared.view(entry.key).frames) == 12
    assert len(shared.inquiry(entry.key).mind(12).objects) > 0
