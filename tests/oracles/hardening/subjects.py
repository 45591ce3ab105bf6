"""The kinds of file that may come from strangers: sound ones to damage, and what reads each."""

from __future__ import annotations

import json
import random
import sqlite3
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.clips import moving_disc, write_clip
from tests.oracles.hardening.documents import documents
from tests.oracles.hardening.media import media
from tests.oracles.hardening.mutations import mutated
from visup.agent.model.errors import VisupError
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.agent.storage.seal import own_key, seal, unsealed
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.signals import read_signals
from visup.percepts.taught.taught_view import taught_view
from visup.rules.language.parser import load_rules
from visup.runs.checkpoints import CHECKPOINT, read_checkpoint
from visup.runs.inputs.zones import load_ground, load_zones
from visup.runs.replay import recorded_transcript, replay, settings_for
from visup.runs.resume import interrupted_run
from visup.runs.runner import Audience, supervise
from visup.runs.settings import RunOptions, WatchSettings
from visup.tasks import load_tasks
from visup.tasks.supervision.supervise import task_reasoner
from visup.tasks.tools.outline import outline

ROOT = Path(__file__).resolve().parents[3]


@dataclass(frozen=True, slots=True)
class Subject:
    """A kind of file.

    Attributes:
        make: A damaged one, written into an empty folder; by dice.
        read: Reads it, as visup does; raises VisupError where it is refused.
    """

    make: Callable[[Path, random.Random], None]
    read: Callable[[Path], None]


def subjects(place: Path) -> Mapping[str, Subject]:
    """All kinds, by name.

    Args:
        place: An empty folder, for what the sound files are made of.
    """
    clip = write_clip(place / "clip.avi", moving_disc(12), fps=10.0)
    run = interrupted_run_at(place, clip)
    database = _database(place)
    texts = {
        "tasks": ("a.task", sorted((ROOT / "tasks" / "shipped").glob("*.task")), _tasks),
        "rules": ("a.rules", [ROOT / "rules" / "safety" / "safety.rules"], _rules),
    }
    kinds = {
        kind: Subject(_damaging(name, [f.read_bytes() for f in files]), read)
        for kind, (name, files, read) in texts.items()
    }
    journal, state = (run / JOURNAL).read_bytes(), unsealed((run / CHECKPOINT).read_bytes())
    return kinds | {
        "zones": Subject(_damaging("zones.toml", [ZONES]), _zones),
        "settings": Subject(_damaging("settings.toml", [SETTINGS]), _settings),
        "answers": Subject(_damaging("answers", [b"1=arm\n2=part\n# no\n"]), _answers),
        "language server": Subject(kinds["tasks"].make, _lsp),
        "databases": Subject(_damaging("a.models", [database]), _models),
        "journals": Subject(_damaging(JOURNAL, [journal]), _journal),
        "journals of other content": Subject(lambda f, rng: _rewritten(f, rng, journal), _journal),
        "resumed journals": Subject(_resumable(journal, state), _resumed),
        "states": Subject(_damaging_state(state), _state),
        "signals": Subject(_damaging("signals.csv", [SIGNALS]), _signals),
        **{n: Subject(make, read) for n, (make, read) in (documents() | media(clip)).items()},
    }


ZONES = b"""[[zone]]
name = "dock"
polygon = [[10, 10], [80, 10], [80, 60], [10, 60]]
depth = [1.0, 2.0]
[ground]
image = [[0, 0], [90, 0], [90, 70], [0, 70]]
floor = [[0, 0], [1, 0], [1, 1], [0, 1]]
"""
SIGNALS = b"time,battery,door_open,mode\n0,87.5,no,auto\n0.5,,yes,\n12.25,1e-3,no,manual\n"
SETTINGS = b'[behaviours.lamp]\ncontrast = 3\ncolours = ["red", "blue"]\nat = 2020-01-01\n'


class _Stop(Exception):
    pass


def interrupted_run_at(place: Path, clip: Path) -> Path:
    """A run in `place`/run that was killed at its eighth frame, with a state."""
    folder = place / "run"
    folder.mkdir()

    def stop(step: Any, frame: Any) -> None:
        if step.frame_index == 8:
            raise _Stop

    options = RunOptions(video=False, report=False, state_every_s=0.2)
    with suppress(_Stop):
        supervise(WatchSettings(str(clip)), folder, audience=Audience([stop]), options=options)
    with closing(sqlite3.connect(folder / JOURNAL)) as db:
        db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return folder


def _database(place: Path) -> bytes:
    image = np.random.default_rng(1).integers(0, 255, (60, 60, 3)).astype(np.uint8)
    views = [taught_view(n, image, [[9, 9], [40, 9], [40, 40], [9, 40]]) for n in ("arm", "part")]
    return ModelDatabase.create(place / "a.models").teach(views, silhouettes=True).path.read_bytes()


def _damaging(name: str, seeds: list[bytes]) -> Callable[[Path, random.Random], None]:
    def make(folder: Path, rng: random.Random) -> None:
        (folder / name).write_bytes(mutated(seeds, rng))

    return make


def _damaging_state(state: bytes) -> Callable[[Path, random.Random], None]:
    """A state that is damaged, mostly under a seal that is right: without one nothing of it is read."""

    def make(folder: Path, rng: random.Random) -> None:
        data = mutated([state], rng)
        (folder / CHECKPOINT).write_bytes(data if rng.random() < 0.1 else seal(data, own_key()))

    return make


def _resumable(journal: bytes, state: bytes) -> Callable[[Path, random.Random], None]:
    """A journal and a state, either of them damaged."""

    def make(folder: Path, rng: random.Random) -> None:
        (folder / JOURNAL).write_bytes(journal)
        (folder / CHECKPOINT).write_bytes(seal(state, own_key()))
        if rng.random() < 0.5:
            _rewritten(folder, rng, journal)
        else:
            _damaging_state(state)(folder, rng)

    return make


ODD: tuple[Any, ...] = (
    None, True, -1, 0, 10**12, 1e308, "x", "", [], {}, [[]], {"$": "tuple", "of": [1]}, {"$": "x"},
    {"$": "array", "dtype": "<f8", "shape": [10**9], "of": ""}, "\x1b[2J", ["a"] * 50, {"$": ["x"]},
)  # fmt: skip


def _rewritten(folder: Path, rng: random.Random, journal: bytes) -> None:
    """A sound file whose content is not: values in its documents are others, check sums are right."""
    path = folder / JOURNAL
    path.write_bytes(journal)
    with closing(sqlite3.connect(path)) as db:
        table, column = rng.choice(
            [("steps", "seen"), ("steps", "seen"), ("steps", "summary"), ("events", "record"),
             ("run", "value"), ("alerts", "record")]
        )  # fmt: skip
        key_of = "key" if table == "run" else "rowid"
        rows = db.execute(f"SELECT {key_of}, {column} FROM {table}").fetchall()
        for key, old in rng.sample(rows, min(len(rows), 2)):
            document = json.loads(zlib.decompress(old) if column == "seen" else old)
            holder: Any = {"": document}
            for _ in range(rng.choice((1, 2))):
                _change(holder, rng)
            text = json.dumps(holder[""])
            new = zlib.compress(text.encode()) if column == "seen" else text
            db.execute(f"UPDATE {table} SET {column} = ? WHERE {key_of} = ?", (new, key))
            if isinstance(new, bytes):
                crc = zlib.crc32(new)
                db.execute("UPDATE steps SET crc = ? WHERE frame_index = ?", (crc, key))
        db.commit()


def _change(document: Any, rng: random.Random) -> None:
    """Put something odd in a place of a document, or take the place out."""
    places = list(_places(document))
    holder, key = rng.choice(places)
    if rng.random() < 0.15 and isinstance(holder, dict) and key != "":
        del holder[key]
    elif rng.random() < 0.2:
        other, name = rng.choice(places)
        holder[key] = json.loads(json.dumps(other[name]))
    else:
        holder[key] = json.loads(json.dumps(rng.choice(ODD)))


def _places(document: Any) -> Iterator[tuple[Any, Any]]:
    keys = document.keys() if isinstance(document, dict) else range(len(document))
    for key in list(keys):
        yield document, key
        if isinstance(document[key], dict | list):
            yield from _places(document[key])


def _tasks(folder: Path) -> None:
    tasks = load_tasks(folder / "a.task")
    task_reasoner(tasks)
    for task in tasks:
        outline(task)


def _rules(folder: Path) -> None:
    load_rules(folder / "a.rules")


def _zones(folder: Path) -> None:
    load_zones(folder / "zones.toml")
    load_ground(folder / "zones.toml")


def _settings(folder: Path) -> None:
    from visup.agent.plugins.settings import read_settings

    read_settings(folder / "settings.toml")


def _answers(folder: Path) -> None:
    from visup.runs.operator import read_answers

    read_answers(folder / "answers")


def _lsp(folder: Path) -> None:
    """What the language server asks of a document."""
    from visup.tasks.checks.diagnose import diagnose
    from visup.tasks.checks.files import read_text
    from visup.tasks.tools import editing
    from visup.tasks.tools.formatter import formatted

    text = read_text(folder / "a.task")
    _, faults = diagnose(text, "a.task")
    for line, column in ((1, 1), (3, 9), (10**6, 10**6)):
        editing.completions(text, "a.task", line, column)
        word = editing.name_at(text, line, column)
        if word is not None:
            editing.hover(text, "a.task", word)
            editing.references(text, word)
    if not faults:
        formatted(text)


def _signals(folder: Path) -> None:
    read_signals(folder / "signals.csv").at(1.0)


def _models(folder: Path) -> None:
    database = ModelDatabase.open(folder / "a.models")
    list(database.taught)
    mask = np.zeros((60, 60), bool)
    mask[10:40, 10:50] = True
    database.query(mask)


def _journal(folder: Path) -> None:
    from visup.api.recorded import open_run

    run = Recording.open(folder)
    recorded_transcript(run)
    list(run.summaries())
    replay(run, settings_for(run))
    told = open_run(folder)
    _ = told.settings, told.verdict, len(told.events), len(told.alerts)


def _resumed(folder: Path) -> None:
    past = interrupted_run(folder)
    if Path(past.settings.source).name == "clip.avi":
        supervise(past.settings, folder, options=RunOptions(video=False, report=False), past=past)


def _state(folder: Path) -> None:
    read_checkpoint(folder)


REFUSED = VisupError
