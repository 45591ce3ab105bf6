"""Tables of figures: whole at 80 columns, whatever figures are called and however many items there are."""

from __future__ import annotations

import io
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from visup.commands.eval.catalogue import EVALUATIONS
from visup.commands.eval.evaluation import EvaluationCommand
from visup.commands.eval.figures_table import figures_tables

VALUES = st.one_of(
    st.floats(0, 1), st.floats(10, 9999), st.integers(0, 99999), st.sampled_from(["in_progress"])
)


def printed(figures: dict[str, Any], keys: tuple[str, ...]) -> list[str]:
    out = io.StringIO()
    console = Console(file=out, width=80)
    console.print(*figures_tables("title", figures, keys))
    return out.getvalue().splitlines()


def uniform_figures(names: list[str], keys: tuple[str, ...], value: Any) -> dict[str, Any]:
    return {
        "items": {n: dict.fromkeys(keys, value) for n in names},
        "total": dict.fromkeys(keys, 1),
    }


@pytest.mark.parametrize("evaluation", [e for e in EVALUATIONS if e.keys], ids=lambda e: e.name)
@pytest.mark.parametrize("count", [1, 5, 30])
@pytest.mark.parametrize("value", [0.123, 12345.6, "in_progress", "interrupted"])
def test_tables_of_all_evaluations_fit_80_columns(
    evaluation: EvaluationCommand, count: int, value: Any
) -> None:
    names = [f"droid_chips_noapproach_{n}" for n in range(count)]
    lines = printed(uniform_figures(names, evaluation.keys, value), evaluation.keys)
    assert max(map(len, lines)) <= 80
    assert not any("…" in line for line in lines)


@settings(max_examples=40)
@given(
    st.lists(
        st.from_regex(r"[a-z]{1,9}(_[a-z]{1,9}){0,3}", fullmatch=True),
        min_size=1,
        max_size=16,
        unique=True,
    ),
    st.lists(st.from_regex(r"[a-z]{1,40}", fullmatch=True), min_size=1, max_size=12, unique=True),
    VALUES,
)
def test_no_figure_is_missing_or_truncated(keys: list[str], names: list[str], value: Any) -> None:
    names = [n for n in names if n != "total"]
    lines = printed(uniform_figures(names, tuple(keys), value), tuple(keys))
    text = "".join(lines)
    assert max(map(len, lines)) <= 80
    assert "…" not in text
    full = f"{value:.3f}" if isinstance(value, float) and value < 10 else str(value)
    full = f"{value:.1f}" if isinstance(value, float) and value >= 10 else full
    assert text.count(full) + text.count("in pr.") >= len(keys) * len(names)


def test_figures_that_no_item_has_are_left_out() -> None:
    lines = printed({"items": {"a": {"J": 0.5}}, "total": {"J": 0.5}}, ("J", "F"))
    assert not any("F" in line for line in lines)
