"""Files from strangers that are pipes, devices or far too much: refused at once, and none made elsewhere."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path

import cv2
import pytest

from tests.clips import moving_disc
from visup.agent.model.errors import OutputError, VisupError
from visup.agent.storage.journal import Journal, JournalLimits
from visup.agent.storage.journal_reader import JOURNAL
from visup.agent.storage.text_file import check_room
from visup.percepts.detections.files import read_detections
from visup.percepts.shape.building.build_parts import parts_of
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.signals import read_signals
from visup.percepts.video import open_source
from visup.runs.operator import read_answers
from visup.runs.recorder import free_path

READERS: dict[str, Callable[[Path], object]] = {
    "detections": read_detections,
    "signals": read_signals,
    "answers": read_answers,
    "meshes": lambda path: parts_of(path, path.parent, 10, 0),
    "databases": ModelDatabase.open,
    "sources": lambda path: open_source(str(path)),
}


@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_special_files_are_not_waited_for(
    read: Callable[[Path], object], kind: str, tmp_path: Path
) -> None:
    path = tmp_path / "given"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    with pytest.raises(VisupError):
        read(path)


@pytest.mark.parametrize(
    ("read", "text"),
    [
        (read_detections, '{"annotations":[' + "[]," * 12_000_001 + "[]]}"),
        (read_detections, "\n" * 2_000_001),
        (read_signals, "time,a\n0," + "," * 6_000_001),
        (read_signals, "time,a\n" + "\n" * 6_000_001),
    ],
    ids=["lists", "lines", "cells", "empty lines"],
)
def test_oversized_tables_take_no_memory(
    read: Callable[[Path], object], text: str, tmp_path: Path
) -> None:
    (tmp_path / "table").write_text(text)
    with pytest.raises(VisupError, match="more than"):
        read(tmp_path / "table")


@pytest.mark.parametrize(
    "line",
    [
        "1,1,nan,0,9,9,1",
        "1,1,0,0,1e300,9,1",
        "1,1e300,0,0,9,9,1",
        "inf,1,0,0,9,9,1",
        "1,inf,0,0,9,9,1",
        '{"images":[{"id":1}],"annotations":[{"image_id":1,"bbox":[0,0,1' + "0" * 400 + ",9]}]}",
        '{"annotations":' + "[" * 100_000,
    ],
)
def test_endless_boxes_are_refused(line: str, tmp_path: Path) -> None:
    (tmp_path / "boxes").write_text(line)
    with pytest.raises(VisupError, match="cannot be used"):
        read_detections(tmp_path / "boxes")


def test_only_the_used_columns_of_a_box_are_parsed(tmp_path: Path) -> None:
    (tmp_path / "boxes").write_text("1,7,0,0,9,9,0.5" + ",-1" * 100_000)
    ((box,),) = read_detections(tmp_path / "boxes").values()
    assert (box.track, box.score) == (7, 0.5)


@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_an_unreadable_rate_is_none(kind: str, tmp_path: Path) -> None:
    for n, image in enumerate(moving_disc(2)):
        cv2.imwrite(str(tmp_path / f"{n}.png"), image)
    info = tmp_path / "seqinfo.ini"
    if kind == "pipe":
        os.mkfifo(info)
    else:
        info.symlink_to("/dev/zero")
    with open_source(str(tmp_path)) as video:
        assert video.fps > 0
        assert len(list(video)) == 2


def test_bookmarks_are_limited() -> None:
    check_room(b"[1,2]", 2)
    with pytest.raises(ValueError, match="more than 1 values"):
        check_room(b"[1,2]", 1)


def test_an_oversized_editor_message_is_refused() -> None:
    pytest.importorskip("pygls", reason="the extra visup[lsp] is not installed")
    from visup.commands.task.language_server import serve

    with pytest.raises(VisupError, match="a message of 1000000000000 bytes"):
        serve(io.BytesIO(b"Content-Length: 1000000000000\r\n\r\n{"), io.BytesIO())


def test_dangling_links_are_not_written_through(tmp_path: Path) -> None:
    """A stranger's run folder that is resumed must not make files elsewhere."""
    (tmp_path / "annotated.webm").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "annotated-2.webm").touch()
    assert free_path(tmp_path / "annotated.webm") == tmp_path / "annotated-3.webm"
    (tmp_path / "journal-2.sqlite").symlink_to(tmp_path / "elsewhere")
    journal = Journal(tmp_path / JOURNAL, JournalLimits(segment_s=0.0))
    with pytest.raises(OutputError, match="elsewhere"):
        journal._next_segment()
    assert not (tmp_path / "elsewhere").exists()
