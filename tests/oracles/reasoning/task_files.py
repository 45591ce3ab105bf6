"""`visup eval tasks`: how task files are read when they are damaged, long, or quite usual.

Bars: a fuzz of mutated files (bytes, tokens, lines) gives no traceback, no file takes a second, every
message has its place; 2,000 lines, as many as a task may have, are read and checked in under 2.5 s, a
usual file in under 10 ms.
"""

from __future__ import annotations

import gc
import random
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from visup.evaluation.figures import Progress, silent
from visup.rules.language.diagnostics import Diagnostic, Source
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.checks.files import read_text, shipped_tasks
from visup.tasks.diagnostics.codes import CODES
from visup.tasks.diagnostics.explain import explain
from visup.tasks.diagnostics.normalise import normalise
from visup.tasks.tools.formatter import formatted

LINES = 2_000  # as many as a task may have
SLOW_S = 1.0
TOKENS = (
    "<", ">", "::=", ":=", "|", "(", ")", "&", "?", "*", "+", ",", "for", "within", "5 s", "3", "%", "px",
    "actor", "optional", "is", "or", "and", "not", "never", "always", "during", "zone", "parameter",
    'include "dock"', '"', "task", "any order", "at least", "2 times", "begins when", "fails when", "size",
    "gap(a, b) < 5 px", "<dock>", "coupled(arm, satellite)", "#", "\t", "“", "é", "🛰", "=", ";", "[", "}",
)  # fmt: skip
CHARACTERS = "\x00\t\n\r\"'#<>()|&?*+=:;,._-%/\\0aé“\u200b\u2028\ufeff\ud83d衛🛰"


@dataclass
class Fuzz:
    """What came of a fuzz.

    Attributes:
        count: Files.
        raised: What was raised instead of a message, with the seed of each such file.
        placeless: Seeds of files with a message without a proper place.
        unstable: Seeds of files that were read, but whose layout is not stable or changes the tree.
        slow: Seeds of files that took a second or more.
        slowest_s: The longest time of a file.
        good: Files without a mistake.
        codes: How often each code was given.
    """

    count: int = 0
    raised: list[tuple[int, str]] = field(default_factory=list)
    placeless: list[int] = field(default_factory=list)
    unstable: list[int] = field(default_factory=list)
    slow: list[int] = field(default_factory=list)
    slowest_s: float = 0.0
    good: int = 0
    codes: Counter[str] = field(default_factory=Counter)

    @property
    def failures(self) -> int:
        """How many files missed the bar."""
        return len(self.raised) + len(self.placeless) + len(self.unstable) + len(self.slow)


def evaluate_tasks(count: int, seed: int, progress: Progress = silent) -> dict[str, Any]:
    """Corrupted task files, long ones, and a usual one.

    Args:
        count: How many corrupted files are read.
        seed: Of the first; one more for each file.
        progress: Shows what is being done.

    Returns:
        `total` with counts and times, `failures` in words, and whether it `failed`.
    """
    progress(f"{count} corrupted files")

    found = fuzz(count, seed)
    times = {f"long_{name}_s": seconds(text) for name, text in long_files()}
    times["usual_ms"] = 1000 * seconds(read_text("inspect"), 20)
    total = {
        "files": found.count,
        "tracebacks": len(found.raised),
        "without_place": len(found.placeless),
        "layout_unstable": len(found.unstable),
        "over_1_s": len(found.slow),
        "slowest_s": round(found.slowest_s, 3),
        "read_without_mistake": found.good,
        "codes_given": len(found.codes),
        **{name: round(value, 3) for name, value in times.items()},
    }
    seeds = {"without place": found.placeless[:10], "unstable": found.unstable[:10]}
    failures = [f"seed {number}: {what}" for number, what in found.raised[:10]]
    failures += [f"{name}: seeds {some}" for name, some in seeds.items() if some]
    return {"total": total, "items": {}, "failures": failures, "failed": bool(found.failures)}


def seeds_of_language() -> list[str]:
    """Files to damage: the shipped tasks, and the examples of all mistakes and their mending."""
    told = [explain(code) for code in CODES]
    return [*map(read_text, shipped_tasks()), *(t for e in told for t in (e.wrong, e.right) if t)]


def fuzz(count: int, seed: int) -> Fuzz:
    """Read mutated files.

    Args:
        count: How many.
        seed: Of the first; file i is made from `seed + i` alone.
    """
    result, texts = Fuzz(), seeds_of_language()
    diagnose(texts[0])  # what is read once for all is read before the clock runs
    gc.collect()
    gc.freeze()  # what others hold in this process is not gone through on this clock
    try:
        _look_at_all(texts, range(seed, seed + count), result)
    finally:
        gc.unfreeze()
    return result


def _look_at_all(texts: Sequence[str], numbers: Iterable[int], result: Fuzz) -> None:
    for number in numbers:
        rng = random.Random(number)
        text = mutated(rng.choice(texts), rng)
        result.count += 1
        begin = time.process_time()
        try:
            _look(text, number, result)
        except Exception as e:  # whatever it is, it is what we look for
            result.raised.append((number, f"{type(e).__name__}: {e}"[:200]))
        taken = time.process_time() - begin
        result.slowest_s = max(result.slowest_s, taken)
        if taken >= SLOW_S:
            result.slow.append(number)


def _look(text: str, number: int, result: Fuzz) -> None:
    task, faults = diagnose(text, "fuzz.task")
    lines = text.split("\n")
    result.codes.update(f.code for f in faults)
    if not all(_placed(f, lines) for f in faults):
        result.placeless.append(number)
    if not faults:
        result.good += 1
        code, _ = normalise(text, Source(text, ""))
        new = formatted(code)
        if formatted(new) != new or diagnose(new, "fuzz.task")[0] != task:
            result.unstable.append(number)


def _placed(fault: Diagnostic, lines: list[str]) -> bool:
    place = fault.place
    if fault.code not in CODES or not fault.message:
        return False
    if place.file != "fuzz.task":
        return place.line >= 1 and place.column >= 1
    return 1 <= place.line <= len(lines) and 1 <= place.column <= len(lines[place.line - 1]) + 1


def mutated(text: str, rng: random.Random) -> str:
    """A text with bytes, words or lines taken out, put in, doubled, swapped or cut."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        kind = rng.randrange(8)
        i, j = sorted(rng.randrange(len(text) + 1) for _ in range(2))
        if kind == 0:
            text = text[:i] + text[i + 1 :]
        elif kind == 1:
            text = text[:i] + rng.choice(CHARACTERS) + text[i + rng.randrange(2) :]
        elif kind == 2:
            text = text[:i] + f" {rng.choice(TOKENS)} " + text[i:]
        elif kind == 3:
            text = text[:i] + text[min(j, i + 20) :]
        elif kind == 4:
            text = text[:i] + text[i : i + 30] * rng.randint(2, 40) + text[i:]
        elif kind == 5:
            text = _bytes(text, rng)
        elif kind == 6:
            lines = text.split("\n")
            rng.shuffle(lines)
            text = "\n".join(lines)
        else:
            text = _words(text, rng)
    return text


def _bytes(text: str, rng: random.Random) -> str:
    data = bytearray(text.encode("utf-8", "replace"))
    for _ in range(rng.randint(1, 4)):
        if data:
            data[rng.randrange(len(data))] = rng.randrange(256)
    return data.decode("utf-8", "replace")


def _words(text: str, rng: random.Random) -> str:
    words = text.split(" ")
    a, b = rng.randrange(len(words)), rng.randrange(len(words))
    words[a], words[b] = words[b], words[a]
    if rng.random() < 0.5:
        words[a] = rng.choice(TOKENS)
    return " ".join(words)


def long_files(lines: int = LINES) -> Iterator[tuple[str, str]]:
    """(name, text) of long files: flat, each stage referring to the next, all mistaken."""
    n = lines - 1
    flat = [f"<s{i}> ::= converging(arm, satellite) for 5 s within 60 s" for i in range(n)]
    yield "flat", "\n".join([f"<t> ::= {' '.join(f'<s{i}>' for i in range(n))}", *flat])
    chain = [f"<s{i}> ::= converging(arm, satellite) for 5 s <s{i + 1}>" for i in range(n)]
    yield "chain", "\n".join([*chain, f"<s{n}> ::= coupled(arm, satellite)"])
    wrong = [f"<s{i}> ::= converging(arm satellite)" for i in range(n)]
    yield "mistaken", "\n".join([f"<t> ::= {' '.join(f'<s{i}>' for i in range(n))}", *wrong])


def seconds(text: str, times: int = 3) -> float:
    """The least of several times that a text takes to be read and checked, of the processor."""
    taken = []
    for _ in range(times):
        begin = time.process_time()
        diagnose(text)
        taken.append(time.process_time() - begin)
    return min(taken)
