"""Every key of a TOML file is found in its line, whatever the file."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.serving.site.toml_lines import locate, syntax_location

NAMES = st.from_regex(r"[a-z][a-z0-9_-]{0,6}", fullmatch=True)
KEYS = st.lists(NAMES, min_size=0, max_size=4, unique=True)


@settings(max_examples=30)
@given(KEYS, st.lists(KEYS, max_size=2), st.integers(0, 2))
def test_keys_are_located_as_tomllib_reads_them(
    top: list[str], tables: list[list[str]], blank: int
) -> None:
    """Each value is the number of its own line."""
    lines: list[str] = []
    lines += [f"{key} = {len(lines) + i + 1}" for i, key in enumerate(top)]
    for keys in tables:
        lines += [""] * blank + ["[[entry]]"]
        first = len(lines)
        lines += [f"{key} = {first + i + 1}" for i, key in enumerate(keys)]
    text = "\n".join(lines)
    document = tomllib.loads(text)
    for key in top:
        if key != "entry":
            assert locate(text, (key,), "f").line == document[key]
    for number, keys in enumerate(tables if "entry" not in top else []):
        for key in keys:
            found = locate(text, ("entry", number, key), "f")
            assert found.line == document["entry"][number][key]
            assert found.text.startswith(key)


TEXT = """store = "x"
[limits]
memory_mb = 3

[[camera]]
  name = "a"
[[camera]]
name = "b"
actors = { arm = 3 }
"""


@pytest.mark.parametrize(
    ("path", "line", "column"),
    [
        (("store",), 1, 1),
        (("limits", "memory_mb"), 3, 1),
        (("limits", "missing"), 2, 1),
        (("camera", 0, "name"), 6, 3),
        (("camera", 1), 7, 1),
        (("camera", 1, "source"), 7, 1),
        (("camera", 1, "actors", "arm"), 9, 1),
        (("nothing",), 1, 1),
    ],
)
def test_a_value_without_a_line_is_located_at_its_table(
    path: tuple[str | int, ...], line: int, column: int
) -> None:
    found = locate(TEXT, path, "f")
    assert (found.line, found.column) == (line, column)


@pytest.mark.parametrize(("text", "line"), [("a = 1\nb = = 2\n", 2), ('a = "', 1), ("", 1)])
def test_syntax_errors_are_located(text: str, line: int) -> None:
    try:
        tomllib.loads(text)
        said = ""
    except tomllib.TOMLDecodeError as fault:
        said = str(fault)
    assert syntax_location(text, said, "f").line == line
