"""The house stays readable: rooms, files, functions and names keep to their measures."""

from __future__ import annotations

import ast
import re
from collections import Counter, defaultdict
from functools import cache
from pathlib import Path
from statistics import median

import pytest

from tests.paths import ROOT

PARTS = ("agent", "percepts", "rules", "tasks", "visup")
MAX_MODULES = 14
MAX_LINES = 400
LONG_FUNCTION = 40
MAX_LONG_FUNCTIONS = 10
MANY_PARAMETERS = 6
MAX_WITH_MANY_PARAMETERS = 15
Function = ast.FunctionDef | ast.AsyncFunctionDef


def sources() -> list[Path]:
    """Every module of the package once, not again behind the links of `visup/`."""
    found = []
    for path in (p for part in PARTS for p in (ROOT / part).rglob("*.py")):
        parts = path.relative_to(ROOT).parts
        if not (parts[0] == "visup" and parts[1] in PARTS):
            found.append(path)
    return sorted(found)


SOURCES = sources()


@cache
def trees() -> dict[Path, ast.Module]:
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in SOURCES}


@cache
def functions() -> list[tuple[Path, Function]]:
    return [
        (path, node)
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, Function)
    ]


def code_lines(function: Function) -> int:
    """Lines of a function without its docstring."""
    lines = (function.end_lineno or function.lineno) - function.lineno + 1
    if ast.get_docstring(function) is None:
        return lines
    docstring = function.body[0]
    return lines - ((docstring.end_lineno or docstring.lineno) - docstring.lineno + 1)


def parameters(function: Function) -> int:
    """Parameters besides `self` and `cls`."""
    given = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return len([a for a in given if a.arg not in ("self", "cls")])


def test_no_room_holds_more_modules_than_one_can_look_over() -> None:
    modules = [path for path in SOURCES if path.name != "__init__.py"]
    rooms = Counter(path.parent.relative_to(ROOT).as_posix() for path in modules)
    assert {room: n for room, n in rooms.items() if n > MAX_MODULES} == {}


def test_no_file_is_too_long() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in SOURCES}
    assert {p.relative_to(ROOT).as_posix(): n for p, n in lengths.items() if n > MAX_LINES} == {}


def test_functions_are_small() -> None:
    lengths = sorted(code_lines(f) for _, f in functions())
    assert median(lengths) <= 7
    assert lengths[int(0.9 * len(lengths))] <= 18
    long = [f"{p.name}:{f.name}" for p, f in functions() if code_lines(f) > LONG_FUNCTION]
    assert len(long) <= MAX_LONG_FUNCTIONS, long


def test_functions_take_few_parameters() -> None:
    many = [f"{p.name}:{f.name}" for p, f in functions() if parameters(f) > MANY_PARAMETERS]
    assert len(many) <= MAX_WITH_MANY_PARAMETERS, many


def test_no_class_name_stands_for_two_ideas() -> None:
    where = defaultdict(list)
    for path, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                where[node.name].append(path.relative_to(ROOT).as_posix())
    assert {name: paths for name, paths in where.items() if len(paths) > 1} == {}


@pytest.mark.parametrize(
    "room", [p for p in SOURCES if p.name == "__init__.py"], ids=lambda p: p.parent.name
)
def test_every_room_says_what_it_is_for(room: Path) -> None:
    said = ast.get_docstring(trees()[room]) or ""
    assert len(said.split()) >= 5
    assert "Placeholder" not in said


EXAMPLES_OF_NAMES = {"FILE.py"}
"""Names in backticks that stand for a file of the user's."""


def test_files_that_the_sources_name_exist() -> None:
    tests = {path.name for path in (ROOT / "tests").rglob("*.py")}
    known = {path.name for path in SOURCES} | tests | EXAMPLES_OF_NAMES
    named = {
        (path.relative_to(ROOT).as_posix(), name)
        for path in SOURCES
        for name in re.findall(r"`(?:\w+/)*(\w+\.py)`", path.read_text(encoding="utf-8"))
    }
    assert {(where, name) for where, name in named if name not in known} == set()


def test_loops_are_compiled_in_one_place() -> None:
    """Elsewhere numba's cache would be a must, and who may write nowhere could not import visup."""
    direct = [
        str(path.relative_to(ROOT))
        for path in sources()
        if "njit" in path.read_text() and path != ROOT / "visup" / "compiled.py"
    ]
    assert direct == []
