"""Further things to damage: meshes, boxes of a detector, what an editor sends to the language server."""

from __future__ import annotations

import io
import json
import logging
import random
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tests.oracles.hardening.mutations import mutated
from visup.percepts.detections.files import read_detections
from visup.percepts.shape.building.build_parts import parts_of
from visup.percepts.shape.building.mesh_views import load_mesh

Make = Callable[[Path, random.Random], None]
Read = Callable[[Path], None]

MOT = b"1,1,10,10,20,20,0.9,-1,-1,-1\n2,1,12,10,20,20,0.9,-1,-1,-1\n2,2,50,40,9,9,1,-1,-1,-1\n"
COCO = json.dumps(
    {
        "images": [{"id": 7, "file_name": "a.png"}, {"id": 9, "file_name": "b.png"}],
        "categories": [{"id": 1, "name": "car"}],
        "annotations": [
            {"id": 1, "image_id": 7, "category_id": 1, "bbox": [1, 2, 30, 40.5], "track_id": 3},
            {"id": 2, "image_id": 9, "category_id": 1, "bbox": [2, 2, 30, 41], "track_id": 3},
        ],
    }
).encode()

TASK = "<t> ::= converging(a, b) <held>\n<held> ::= touching(a, b) for 2 s\n"


def documents() -> dict[str, tuple[Make, Read]]:
    """Kinds of documents: what makes a damaged one, and what reads it."""
    found: dict[str, tuple[Make, Read]] = {
        "detections": (_named("boxes", [MOT, COCO]), lambda f: _read(read_detections, f)),
        "editor messages": (_named("messages", [_session()]), _serve),
    }
    meshes = _meshes()
    if meshes:
        found["meshes"] = (_of_many(meshes), _read_mesh)
    return found


def _named(name: str, seeds: list[bytes]) -> Make:
    def make(folder: Path, rng: random.Random) -> None:
        (folder / name).write_bytes(mutated(seeds, rng))

    return make


def _of_many(files: Mapping[str, bytes]) -> Make:
    def make(folder: Path, rng: random.Random) -> None:
        name = rng.choice(sorted(files))
        (folder / name).write_bytes(mutated([files[name]], rng))

    return make


def _read(read: Callable[[Path], Any], folder: Path) -> None:
    (path,) = folder.iterdir()
    read(path)


def _meshes() -> dict[str, bytes]:
    """A cube in each form; none without the extra that reads meshes."""
    try:
        import trimesh
    except ImportError:
        return {}
    cube, found = trimesh.creation.box(), {}
    for ending in ("ply", "stl", "obj", "off", "glb"):
        with tempfile.TemporaryDirectory() as scratch:
            path = Path(scratch) / f"a.{ending}"
            cube.export(path)
            found[path.name] = path.read_bytes()
    return found


def _read_mesh(folder: Path) -> None:
    (path,) = folder.iterdir()
    parts_of(path, folder, 2, 0)
    load_mesh(path)


def _session() -> bytes:
    """What an editor sends from beginning to end."""
    document = {"uri": "file:///a.task"}
    at = {"textDocument": document, "position": {"line": 0, "character": 12}}
    opened = {**document, "languageId": "visup-task", "version": 1, "text": TASK}
    change = {"range": None, "text": TASK.replace("2 s", "3 s")}
    options = {"tabSize": 4, "insertSpaces": True}
    sent: list[tuple[str, Any]] = [
        ("initialize", {"processId": None, "rootUri": None, "capabilities": {}}),
        ("initialized", {}),
        ("textDocument/didOpen", {"textDocument": opened}),
        ("textDocument/completion", at),
        ("textDocument/hover", at),
        ("textDocument/definition", at),
        ("textDocument/rename", {**at, "newName": "b"}),
        ("textDocument/formatting", {"textDocument": document, "options": options}),
        (
            "textDocument/didChange",
            {
                "textDocument": {**document, "version": 2},
                "contentChanges": [{"text": change["text"]}],
            },
        ),
        ("textDocument/didClose", {"textDocument": document}),
        ("shutdown", None),
        ("exit", None),
    ]
    return b"".join(_message(n, method, params) for n, (method, params) in enumerate(sent))


def _message(number: int, method: str, params: Any) -> bytes:
    silent = method in ("initialized", "exit") or "/did" in method
    document = {"jsonrpc": "2.0", "method": method, "params": params}
    body = json.dumps(document if silent else {**document, "id": number}).encode()
    return b"Content-Length: %d\r\n\r\n%s" % (len(body), body)


def _serve(folder: Path) -> None:
    from visup.commands.task.language_server import serve

    logging.disable(logging.CRITICAL)  # what is wrong with a message is told to whoever sent it
    serve(io.BytesIO((folder / "messages").read_bytes()), io.BytesIO())
