"""What all pages share."""

from __future__ import annotations

from pathlib import Path

import pytest

from visup.agent.model.errors import ErrorGroup, OutputError, SourceLocation, TaskError
from visup.console import state

SECRET = TaskError("unexpected word", where=SourceLocation("/etc/keys", 1, 1, "swordfish", 9))


@pytest.mark.parametrize("fault", [SECRET, ErrorGroup([SECRET, SECRET])])
def test_no_line_of_a_file_that_only_a_run_names_is_quoted(
    fault: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(folder: Path) -> None:
        raise fault

    monkeypatch.setattr(state, "Inquiry", refused)
    with pytest.raises(OutputError) as told:
        state._opened(tmp_path)
    assert "swordfish" not in str(told.value)
    assert "/etc" not in str(told.value)
