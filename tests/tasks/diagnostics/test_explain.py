from __future__ import annotations

import pytest

from visup.agent.model.errors import TaskError
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.diagnostics.codes import CODES
from visup.tasks.diagnostics.explain import explain


@pytest.mark.parametrize("code", CODES)
def test_examples_of_error_codes_have_exactly_their_mistake(
    code: str,
) -> None:
    explanation = explain(code)
    assert explanation.title == CODES[code]
    assert explanation.why.endswith(".")
    if explanation.wrong:
        assert [f.code for f in diagnose(explanation.wrong)[1]] == [code]
        assert diagnose(explanation.right)[1] == []


def test_error_codes_are_found_as_printed_and_unknown_ones_refused() -> None:
    assert explain("[e102]") == explain("E102")
    assert "wrong:\n    <dock> = " in str(explain("E102"))
    with pytest.raises(TaskError, match="no code `E999`"):
        explain("E999")
