"""Explains an error code with a wrong and a right example: `visup task explain CODE`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import TaskError
from visup.tasks.diagnostics.codes import CODES


@dataclass(frozen=True, slots=True)
class CodeExplanation:
    """The explanation of a code.

    Attributes:
        code: `E102`.
        title: Its meaning, one clause.
        why: Some sentences.
        wrong: A file with this mistake, or empty.
        right: The corrected file, or empty.
    """

    code: str
    title: str
    why: str
    wrong: str
    right: str

    def __str__(self) -> str:
        said = [f"{self.code}: {self.title}", "", self.why]
        for word, text in (("wrong", self.wrong), ("right", self.right)):
            if text:
                said += ["", f"{word}:", *(f"    {line}" for line in text.split("\n"))]
        return "\n".join(said)


def explain(code: str) -> CodeExplanation:
    """The explanation of a code, in upper or lower case.

    Raises:
        TaskError: There is no such code.
    """
    found = _all().get(code.strip("[]").upper())
    if found is None:
        expected = (
            f"`{next(iter(CODES))}` to `{list(CODES)[-1]}`, as messages show them in brackets"
        )
        hint = did_you_mean(code.upper(), CODES, "`{}`")
        raise TaskError(f"there is no code `{code}`", expected=expected, hint=hint)
    return found


@lru_cache(maxsize=1)
def _all() -> dict[str, CodeExplanation]:
    text = files("visup.tasks.diagnostics").joinpath("explanations.txt").read_text(encoding="utf-8")
    made = (_read(block.split("\n")) for block in text.strip().split("\n\n"))
    return {e.code: e for e in made}


def _read(lines: list[str]) -> CodeExplanation:
    code, *rest = lines

    def marked(mark: str) -> str:
        return "\n".join(line[2:] for line in rest if line.startswith(mark))

    why = " ".join(line for line in rest if not line.startswith(("- ", "+ ")))
    return CodeExplanation(code, CODES[code], why, marked("- "), marked("+ "))
