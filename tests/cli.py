"""The command called within the tests' own process: its exit code and what it printed."""

from __future__ import annotations

import sys
from collections.abc import Callable

import pytest

from visup.cli import main


class Result:
    """How a command ended."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err


Call = Callable[..., Result]


def caller(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """A function that calls `visup` with words."""

    def call(*words: object) -> Result:
        monkeypatch.setattr(sys, "argv", ["visup", *map(str, words)])
        capfd.readouterr()
        try:
            main()
            code = 0
        except SystemExit as end:
            code = int(end.code or 0)
        out, err = capfd.readouterr()
        return Result(code, out, err)

    return call
