from __future__ import annotations

import pytest

from visup.agent.model.errors import TaskError
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.diagnostics.codes import CODES
from visup.tasks.diagnostics.explain import explain


@pytest.mark.parametrize("code", CODES)
def test_the_wrong_example_of_a_code_has_its_mistake_alone_and_the_right_one_none(
    code: str,
) -> None:
    said = explain(code)
    assert said.title == CODES[code]
    assert said.why.endswith(".")
    if said.wrong:
        assert [f.code for f in diagnose(said.wrong)[1]] == [code]
        assert diagnose(said.right)[1] == []


def test_codes_are_found_as_they_are_shown_and_others_are_told() -> None:
    assert explain("[e102]") == explain("E102")
    assert "wrong:\n    <dock> = " in str(explain("E102"))
    with pytest.raises(TaskError, match="no code `E999`"):
        explain("E999")
