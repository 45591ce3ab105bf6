"""The attacks by name: those that once broke visup, and others like them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tests.clips import moving_disc
from tests.oracles.hardening.attack_files import (
    EVIL,
    Make,
    clip,
    giant_png,
    link,
    run,
    run_after,
    run_seeing,
    run_with,
    text,
    together,
)
from tests.oracles.hardening.attacks import KEPT, RAN, Attack

WATCH = "watch clip.avi --no-video --out out"
RULE = 'rule close(a, b): warning\n    when gap(a, b) < 9 px\n    say "{a}."\n'
ENDLESS = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT"
TOUCHES = f"from pathlib import Path\nPath(__file__).with_name({RAN!r}).touch()\n"
LAMP = """
import os, sys, time
from visup.agent import Contract
class Lamp:
    contract = Contract("lamp", gives=("lamp",))
    def perceive(self, frame, seen, directives):
        {}
        return ()
"""


def attacks() -> Mapping[str, Attack]:
    """All of them."""
    return dict(
        [
            *_run_folders(),
            *_journals(),
            *_texts(),
            *_no_files(),
            *_plug_ins(),
            *_pictures(),
            *_links(),
        ]
    )


Named = Iterator[tuple[str, Attack]]


def _run_folders() -> Named:
    code = text("lamp.py", TOUCHES)
    for name, named in {
        "a run folder names code": {"behaviours": ["FOLDER/lamp.py"]},
        "a run folder names code beside it": {"behaviours": ["lamp.py"]},
        "a run folder names a module": {"behaviours": ["lamp:Lamp"]},
        "a run folder names a plug-in": {"plugins": ["shape"]},
    }.items():
        made = {k: [v.replace("FOLDER", ".") for v in vs] for k, vs in named.items()}
        yield name, Attack("watch --resume run", (2,), together(run_with(**made), code), "code")
        yield f"{name}, replayed", Attack("replay run", (0, 2), together(run_with(**made), code))
    odd = {
        "rules": ["/dev/zero"],
        "zones": "/dev/zero",
        "models": "/dev/zero",
        "tasks": ["/dev/zero"],
        "detections": "/dev/zero",
        "signals": ["/dev/zero"],
        "source": "/dev/zero",
    }
    for key, value in odd.items():
        make = run_with(**{key: value})
        # A replay opens neither the source nor what is seen of it.
        yield f"recorded {key} are endless, replayed", Attack("replay run", (0, 2), make)
        yield f"recorded {key} are endless, resumed", Attack("watch --resume run", (2,), make)


def _journals() -> Named:
    view = "CREATE VIEW steps AS " + ENDLESS
    steps = f"{view} x AS frame_index, 0.0 AS time, '' AS summary, x'' AS seen, 0 AS crc FROM n"
    changed: dict[str, Make] = {
        "an endless view": run_after("DROP TABLE steps", steps),
        "a trigger": run_after(
            "CREATE TRIGGER t AFTER INSERT ON steps BEGIN DELETE FROM steps; END"
        ),
        "a box of 20 gigabytes": run_seeing(_in_region(bbox=[0, 0, 200_000, 100_000])),
        "numbers without end": run_after("UPDATE run SET value = '" + "1" * 10**6 + "'"),
        "a verdict that a terminal obeys": run_after(
            "UPDATE run SET value = " + _sql(json.dumps(EVIL)) + " WHERE key = 'verdict'"
        ),
        "steps that were never": run_after("UPDATE steps SET frame_index = frame_index * 1000000"),
        "times before the beginning of the world": run_after("UPDATE steps SET time = -1e308"),
    }
    for name, make in changed.items():
        for words, codes in (("replay run", (0, 1, 2, 3)), ("watch --resume run", (0, 1, 2))):
            yield f"a journal with {name}: {words}", Attack(words, codes, make)
    yield (
        "events that a terminal obeys",
        Attack("replay run --diff", (0, 1, 2), run_after(_told_sql())),
    )
    yield "a pipe for a journal", Attack("replay run", (2,), _pipe("run/journal.sqlite"))


def _in_region(**fields: Any) -> Any:
    def change(document: dict[str, Any]) -> None:
        for report in document["reports"]:
            for percept in report["percepts"]:
                if percept[0] == "region":
                    percept[1].update(fields)

    return change


def _sql(value: str) -> str:
    return "'" + value.replace("'", "''") + "'"


def _told_sql() -> str:
    record = {
        "frame_index": 1, "time": 0.1, "kind": EVIL, "text": EVIL, "objects": [], "severity": "info",
        "data": {},
    }  # fmt: skip
    return (
        "INSERT INTO events (frame_index, time, kind, text, record) VALUES "
        f"(1, 0.1, 'x', 'x', {_sql(json.dumps(record))})"
    )


def _texts() -> Named:
    chain = "\n".join(f"<s{n}> ::= converging(a, b) <s{n + 1}>" for n in range(3000))
    ways = " & ".join(f"(converging(a, b{n}) | touching(a, b{n}))" for n in range(25))
    tasks = {
        "3,000 chained stages": f"{chain}\n<s3000> ::= touching(a, b)",
        "25 pairs at once": f"<t> ::= {ways}",
        "100,000 stages": "<t> ::= " + "\n".join(f"<s{n}>" for n in range(100_000)),
        "5,000 mistakes on a line": "<t> ::= " + " ".join(f"konverging{n}(a, b)" for n in range(5000)),
        "an include of 10,000 letters": f'include "{"x" * 10_000}"\n<t> ::= seen(a)',
        "an include of a secret": f'include "../{KEPT}"\n<t> ::= seen(a)',
        "an include without end": 'include "/dev/zero"\n<t> ::= seen(a)',
        "an include of itself": 'include "a.task"\n<t> ::= seen(a)',
        "words that a terminal obeys": f"<{EVIL}> ::= {EVIL}(a, b)",
        "brackets without end": "<t> ::= " + "(" * 100_000,
        "a number of 10,000 digits": f"<t> ::= seen(a) for {'9' * 10_000} s",
    }  # fmt: skip
    for name, content in tasks.items():
        make = text("a.task", content)
        yield f"a task with {name}, checked", Attack("task check a.task", (1, 2), make)
        yield f"a task with {name}", Attack(f"{WATCH} --task a.task", (2,), make)
    bom = text("a.task", "\ufeff<t> ::= converging(a, b) touching(a, b)\n")
    yield "a byte order mark in a task", Attack("task check a.task", (0,), bom)
    rules = {
        "`not` a thousand deep": RULE.replace("when ", "when " + "not " * 1000),
        "20,000 conditions": RULE.replace(
            "when gap(a, b) < 9 px", "when " + " and ".join(["gap(a, b) < 9 px"] * 20_000)
        ),
        "words that a terminal obeys": RULE.replace("close", EVIL),
        "brackets without end": RULE.replace("gap", "(" * 100_000 + "gap"),
    }
    for name, content in rules.items():
        make = text("a.rules", content)
        yield f"rules with {name}, checked", Attack("rules check a.rules", (1, 2), make)
        yield f"rules with {name}", Attack(f"{WATCH} --rules a.rules", (2,), make)
    bom = text("a.rules", "\ufeff" + RULE)
    yield "a byte order mark in rules", Attack("rules check a.rules", (0,), bom)
    said = text("a.rules", RULE.replace("{a}.", EVIL))
    yield "a sentence that a terminal obeys", Attack(f"{WATCH} --rules a.rules", (0, 1, 2), said)
    boxes = '{"annotations":[' + "[]," * 20_000_000 + "[]]}"
    tables = {
        "20 million lists as detections": ("--detections", boxes),
        "20 million empty lines as detections": ("--detections", "\n" * 20_000_000 + "1,1"),
        "60 million empty cells as signals": ("--signal", "time,a\n0," + "," * 60_000_000),
        "40 million empty lines as signals": ("--signal", "time,a\n" + "\n" * 40_000_000),
        "zones nested without end": ("--zones", "a = " + "[" * 100_000),
        "settings nested without end": ("--settings", "a = " + "{a=" * 100_000),
    }
    for name, (option, content) in tables.items():
        yield name, Attack(f"{WATCH} {option} table.csv", (2,), text("table.csv", content))


OPTIONS = {
    "--task": "a.task", "--rules": "a.rules", "--zones": "a.toml", "--settings": "a.toml",
    "--models": "a.models", "--signal": "a.csv", "--detections": "a.txt", "--answers": "a.txt",
}  # fmt: skip
"""Options that name a file, with a usual name."""


def _no_files() -> Named:
    for option, name in OPTIONS.items():
        for what, make in {"a pipe": _pipe(name), "a device": link(name, "/dev/zero")}.items():
            yield f"{what} for {option}", Attack(f"{WATCH} {option} {name}", (2,), make)
    yield "a network that is a pipe", Attack(f"{WATCH} --detections a.onnx", (2,), _pipe("a.onnx"))
    for name in ("a.avi", "a.mp4", "a.png", "a.mcap"):
        for what, make in {"a pipe": _pipe(name), "a device": link(name, "/dev/zero")}.items():
            yield f"{what} for the source {name}", Attack(f"watch {name} --out out", (2,), make)
    yield "a mesh that is a pipe", Attack("models build a.models a.ply", (1, 2), _pipe("a.ply"))
    yield (
        "a mesh without end",
        Attack("models build a.models a.ply", (1, 2), link("a.ply", "/dev/zero")),
    )
    yield (
        "a picture for a mesh",
        Attack("models build a.models a.ply", (1, 2), text("a.ply", "ply\nformat ascii 1.0\n" * 9)),
    )


def _pipe(name: str) -> Make:
    def make(folder: Path) -> None:
        clip(folder)
        (folder / name).parent.mkdir(exist_ok=True)
        os.mkfifo(folder / name)

    return make


def _plug_ins() -> Named:
    watch = f"{WATCH} --behaviour lamp.py --isolate lamp"
    ends = {
        "that ends its process": "import os; os._exit(0)",
        "that kills itself": "import os; os.kill(os.getpid(), 9)",
        "that calls for an exit": "raise SystemExit(0)",
        "that is no Python": "def (",
        "with a name that a terminal obeys": LAMP.format("pass").replace('"lamp"', repr(EVIL)),
    }
    for name, content in ends.items():
        yield f"a plug-in {name}", Attack(watch, (2,), text("lamp.py", content))
    does = {
        "that prints without end": "while True: print('x' * 2**20)",
        "that ends in the middle": "os._exit(0)",
        "that reports what it may not": "return [object()]",
        "that takes the memory of others": (
            "import mmap; self.m = mmap.mmap(-1, 2**33)\n"
            "        for n in range(0, 2**33, 4096): self.m[n] = 1"
        ),
        "that fills its messages with nonsense": "os.write(int(sys.argv[1]), b'x' * 100)",
        "that leaves processes behind": "os.fork() or time.sleep(90)",
    }
    for name, content in does.items():
        make = text("lamp.py", LAMP.format(content))
        yield f"a plug-in {name}", Attack(watch, (0, 1), make)


def _pictures() -> Named:
    def giants(folder: Path) -> None:
        (folder / "images").mkdir()
        for n in range(2):
            giant_png(folder / "images" / f"{n}.png")

    def of_other_sizes(folder: Path) -> None:
        (folder / "images").mkdir()
        for n, image in enumerate(moving_disc(8)):
            small = image if n < 5 else image[::2, ::2]
            cv2.imwrite(str(folder / "images" / f"{n}.png"), small)

    def cut(folder: Path) -> None:
        data = clip(folder, 30).read_bytes()
        (folder / "clip.avi").write_bytes(data[: len(data) // 2])

    def with_rate(rate: str) -> Make:
        def make(folder: Path) -> None:
            of_other_sizes(folder)
            (folder / "images" / "seqinfo.ini").write_text(f"[Sequence]\nframeRate={rate}\n")

        return make

    def with_endless_rate(folder: Path) -> None:
        of_other_sizes(folder)
        (folder / "images" / "seqinfo.ini").symlink_to("/dev/zero")

    def with_piped_rate(folder: Path) -> None:
        of_other_sizes(folder)
        os.mkfifo(folder / "images" / "seqinfo.ini")

    watch = "watch images --no-video --out out"
    yield "pictures of 900 million pixels", Attack(watch, (2,), giants)
    yield "pictures of other sizes", Attack(watch, (4,), of_other_sizes)
    yield "a video that breaks off", Attack(WATCH, (4,), cut)
    yield "a rate that is none", Attack(watch, (4,), with_rate("-1e999"))
    yield "a rate of a million", Attack(watch, (4,), with_rate("1e300"))
    yield "a rate without end", Attack(watch, (4,), with_endless_rate)
    yield "a rate that is a pipe", Attack(watch, (4,), with_piped_rate)
    yield "a playlist for a video", Attack("watch a.mp4 --out out", (2,), text("a.mp4", PLAYLIST))
    yield "noise for a video", Attack("watch a.mp4 --out out", (2, 4), _noise)


PLAYLIST = "#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nhttp://127.0.0.1:1/a.ts\n#EXT-X-ENDLIST\n"


def _noise(folder: Path) -> None:
    (folder / "a.mp4").write_bytes(np.random.default_rng(0).bytes(100_000))


def _links() -> Named:
    """Files of a run folder that lead elsewhere: what is written must not go there."""
    for name in (
        *("report.html", "events.jsonl", "annotated.webm", "annotated-2.webm", "state.bin"),
        *(".journal.sqlite.lock", ".writable", "journal-2.sqlite", "journal.sqlite-wal"),
    ):
        for what, to in {"a file": KEPT, "nothing": RAN}.items():
            place = f"../../{to}" if to == KEPT else f"../{to}"
            make = together(lambda folder: run(folder), _linked(name, place))
            words = "watch --resume run"
            yield f"{name} of a run leads to {what}", Attack(words, (0, 1, 2, 5), make)


def _linked(name: str, to: str) -> Make:
    def make(folder: Path) -> None:
        path = folder / "run" / name
        path.unlink(missing_ok=True)
        path.symlink_to(to)

    return make
