"""Damaged moving pictures: files in several containers, and motion JPEG as cameras send it."""

from __future__ import annotations

import random
import socket
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from itertools import islice
from pathlib import Path

import cv2

from tests.clips import moving_disc
from tests.oracles.hardening.mutations import mutated
from visup.percepts.video import open_source

FRAMES = 20
CONTAINERS = {"mp4": "mp4v", "mov": "mp4v", "mkv": "mp4v", "webm": "VP80"}
"""File ending -> code of the compression; all are written by the FFmpeg within OpenCV."""
BOUNDARY = b"frame"

Make = Callable[[Path, random.Random], None]
Read = Callable[[Path], None]


def media(clip: Path) -> dict[str, tuple[Make, Read]]:
    """Kinds of moving pictures: what makes a damaged one, and what reads it.

    Args:
        clip: A sound AVI.
    """
    jpeg = [cv2.imencode(".jpg", image)[1].tobytes() for image in moving_disc(6)]
    png = cv2.imencode(".png", moving_disc(1)[0])[1].tobytes()
    containers = _containers()
    sent = b"".join(_part(image) for image in jpeg)
    return {
        "videos": (_damaging("a.avi", [clip.read_bytes()]), lambda f: read_video(f / "a.avi")),
        "video containers": (_of_many(containers), _read_only_file),
        "MJPEG streams": (_damaging("answer", [_HEAD + sent, sent]), _read_stream),
        # Told apart by what is in them, whatever they are called.
        "pictures": (_damaging("0.png", [png, jpeg[0]]), read_video),
    }


_HEAD = b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n"


def _part(image: bytes) -> bytes:
    head = b"--%s\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n"
    return head % (BOUNDARY, len(image)) + image + b"\r\n"


def _containers() -> dict[str, bytes]:
    """A short clip in each container that this OpenCV can write."""
    found = {}
    with tempfile.TemporaryDirectory() as scratch:
        for ending, code in CONTAINERS.items():
            path = Path(scratch) / f"a.{ending}"
            writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*code), 10.0, (96, 72))
            for image in moving_disc(12) if writer.isOpened() else ():
                writer.write(image)
            writer.release()
            if path.exists():
                found[ending] = path.read_bytes()
    return found


def _damaging(name: str, seeds: list[bytes]) -> Make:
    def make(folder: Path, rng: random.Random) -> None:
        (folder / name).write_bytes(mutated(seeds, rng))

    return make


def _of_many(containers: Mapping[str, bytes]) -> Make:
    """One of several containers, at times under the name of another."""

    def make(folder: Path, rng: random.Random) -> None:
        ending = rng.choice(sorted(containers))
        said = rng.choice(sorted(containers)) if rng.random() < 0.2 else ending
        (folder / f"a.{said}").write_bytes(mutated([containers[ending]], rng))

    return make


def read_video(path: Path) -> None:
    """The first frames of a source."""
    with open_source(str(path)) as video:
        for _ in islice(video, FRAMES):
            pass


def _read_only_file(folder: Path) -> None:
    (path,) = folder.iterdir()
    read_video(path)


def _read_stream(folder: Path) -> None:
    answer = (folder / "answer").read_bytes()
    with _served(answer) as url, open_source(url) as video:
        for _ in islice(video, FRAMES):
            pass


@contextmanager
def _served(answer: bytes) -> Iterator[str]:
    """The address of a camera that sends these bytes to whoever asks, and then goes away."""
    with closing(socket.create_server(("127.0.0.1", 0))) as server:
        thread = threading.Thread(target=_serve, args=(server, answer), daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{server.getsockname()[1]}/stream"


def _serve(server: socket.socket, answer: bytes) -> None:
    with suppress(OSError):
        while True:
            client, _ = server.accept()
            with client, suppress(OSError):
                client.recv(65536)
                client.sendall(answer)
