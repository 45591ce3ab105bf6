"""A server for one page and one user, on this machine only, at an unguessable address.

It listens at 127.0.0.1 on a free port; every address begins with a random token; a request must name this
host (a foreign name that points here is refused), and one of another page is refused.
"""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from threading import Event, Lock, Thread
from types import TracebackType
from typing import Any, Self

import cv2

from visup.agent.model.errors import SourceError, VisupError
from visup.teaching.clip_frames import ClipFrames
from visup.teaching.outline_teaching import TeachingResult
from visup.teaching.page.requests import Response, clip_facts, save, snap

HOST = "127.0.0.1"
MAX_BODY_BYTES = 1 << 22
"""Bytes that are read of a request at most."""

POLL_S = 0.05
"""Seconds after which the server sees that it is to end; by default `socketserver` takes half of one."""

_STATIC = {
    "": ("page.html", "text/html; charset=utf-8"),
    "page.js": ("page.js", "text/javascript; charset=utf-8"),
    "page.css": ("page.css", "text/css; charset=utf-8"),
}
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'"
)
_QUALITY = 93


class TeachingPage:
    """The page, served until it is closed.

    Args:
        frames: The clip.
        models: Where what is taught is stored.
        frame: Number of the frame that is shown first.

    Attributes:
        result: All that was stored through the page; None when nothing was.
    """

    def __init__(self, frames: ClipFrames, models: Path, frame: int = 0) -> None:
        self._frames, self._models, self._first = frames, models, frame
        self._token = secrets.token_urlsafe(16)
        # One clip and one database: requests wait for each other.
        self._lock, self._done = Lock(), Event()
        self._server = ThreadingHTTPServer((HOST, 0), partial(_Handler, self))
        self._server.daemon_threads = True
        self.result: TeachingResult | None = None

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return int(self._server.server_address[1])

    @property
    def prefix(self) -> str:
        """What every address begins with."""
        return f"/{self._token}/"

    @cached_property
    def url(self) -> str:
        """The page's address."""
        return f"http://{HOST}:{self.port}{self.prefix}"

    def __enter__(self) -> Self:
        target = self._server.serve_forever
        Thread(target=target, args=(POLL_S,), name="teaching page", daemon=True).start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.shutdown()
        self._server.server_close()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until the user is done; whether he is."""
        return self._done.wait(seconds)

    def picture(self, number: int) -> bytes:
        """A frame as JPEG.

        Raises:
            SourceError: There is no such frame.
        """
        with self._lock:
            picture = self._frames.at(number)
        done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        if not done:
            raise SourceError(f"frame {number} cannot be shown")
        return data.tobytes()

    def facts(self) -> Response:
        """What the page shows at first."""
        with self._lock:
            return clip_facts(self._frames, self._first, self._models)

    def handle(self, what: str, body: Mapping[str, Any]) -> Response | None:
        """The answer to something that the page asks for; None when there is nothing of that name.

        Raises:
            VisupError: What was given is not as it should be.
        """
        with self._lock:
            if what == "snap":
                return snap(self._frames, body)
            if what == "save":
                return self._save(body)
        if what == "done":
            self._done.set()
            return {}
        return None

    def _save(self, body: Mapping[str, Any]) -> Response:
        new, old = save(self._frames, self._models, body), self.result
        views = (*(old.views if old else ()), *new.views)
        self.result = TeachingResult(
            new.database, views, (*(old.messages[:-1] if old else ()), *new.messages)
        )
        return {"messages": new.messages}


class _Handler(BaseHTTPRequestHandler):
    """Answers one request."""

    server_version, sys_version = "visup", ""
    timeout = 30.0

    def __init__(self, page: TeachingPage, *args: Any) -> None:
        self._page = page
        super().__init__(*args)

    def do_GET(self) -> None:
        """The page, its parts, facts on the clip, and frames."""
        path = self._path()
        if path is None:
            return
        if path in _STATIC:
            name, kind = _STATIC[path]
            self._send(files(__package__).joinpath(name).read_bytes(), kind)
        elif path == "clip.json":
            self._respond(self._page.facts)
        elif path.startswith("frame/") and path[6:].isdecimal() and len(path) < 16:
            self._respond(lambda: self._page.picture(int(path[6:])))
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """What changes something; from the page only."""
        path = self._path()
        body = None if path is None else self._body()
        if path is not None and body is not None:
            self._respond(lambda: self._page.handle(path, body))

    def _path(self) -> str | None:
        """What follows the token; None when the request was refused."""
        own_hosts = {f"{name}:{self._page.port}" for name in (HOST, "localhost")}
        origin = self.headers.get("Origin")
        foreign = origin is not None and origin.removeprefix("http://") not in own_hosts
        prefix = self._page.prefix
        has_token = secrets.compare_digest(self.path[: len(prefix)].encode(), prefix.encode())
        if self.headers.get("Host") not in own_hosts or foreign or not has_token:
            self.send_error(HTTPStatus.FORBIDDEN)
            return None
        return self.path[len(prefix) :].partition("?")[0]

    def _body(self) -> Mapping[str, Any] | None:
        length = self.headers.get("Content-Length", "")
        kind = self.headers.get("Content-Type", "").partition(";")[0]
        if kind != "application/json" or not length.isdecimal() or int(length) > MAX_BODY_BYTES:
            self.send_error(HTTPStatus.BAD_REQUEST)
            return None
        try:
            body = json.loads(self.rfile.read(int(length)))
        except ValueError:
            body = None
        if not isinstance(body, Mapping):
            self.send_error(HTTPStatus.BAD_REQUEST)
            return None
        return body

    def _respond(self, answer: Callable[[], Response | bytes | None]) -> None:
        """Send an answer; errors that the user can fix are shown in the page."""
        try:
            response = answer()
        except VisupError as e:
            self._send_json({"error": str(e)}, HTTPStatus.UNPROCESSABLE_ENTITY)
            return
        if response is None:
            self.send_error(HTTPStatus.NOT_FOUND)
        elif isinstance(response, bytes):
            self._send(response, "image/jpeg")
        else:
            self._send_json(response)

    def _send_json(self, response: Response, status: HTTPStatus = HTTPStatus.OK) -> None:
        self._send(json.dumps(response).encode(), "application/json", status)

    def _send(self, data: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.send_header("Content-Security-Policy", _POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, format: str, *args: object) -> None:
        """Nothing is logged: the address holds the token."""
