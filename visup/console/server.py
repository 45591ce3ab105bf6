"""The web application of the console: pages, pictures and the access guard."""

from __future__ import annotations

import logging
import socket
from collections.abc import Callable
from typing import Literal

import uvicorn
from fastapi import FastAPI, HTTPException, Request, Response
from fastapi.responses import FileResponse
from nicegui import app as nicegui_app
from nicegui import ui

from visup.agent.model.errors import SettingsError, VisupError
from visup.console.access import ROLE_KEY, Access, AccessGuard, ConsoleRole
from visup.console.evidence import evidence_of
from visup.console.pages.library_page import library_page
from visup.console.pages.run_page import run_page
from visup.console.pages.wall_page import wall_page
from visup.console.plain_page import plain_page
from visup.console.reasoning.view_comparison import view_comparison_picture
from visup.console.state import ConsoleState

FAVICON = "◉"
SHUTDOWN_TIMEOUT_S = 1
"""How long open pages may delay the shutdown, seconds."""

_IMAGE_HEADERS = {"Cache-Control": "private, max-age=60", "X-Content-Type-Options": "nosniff"}
_MEDIA_TYPES = {"jpg": "image/jpeg", "webm": "video/webm"}


def build_application(state: ConsoleState, access: Access) -> AccessGuard:
    """Build the application; at most one per process, since NiceGUI's pages are global."""
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    _add_image_routes(app, state)
    _add_pages(state)
    nicegui_app.add_exception_handler(404, _no_such_page)
    ui.run_with(app, title="visup", favicon=FAVICON, dark=None, show_welcome_message=False)
    return AccessGuard(app, access)


def _add_image_routes(app: FastAPI, state: ConsoleState) -> None:
    """Serve pictures; they are drawn in threads, so that a large one does not block the pages."""

    @app.get("/picture/{key}/{number}.jpg")
    def picture(key: str, number: int, plain: bool = False) -> Response:
        return _jpeg(lambda: state.view(key).picture(number, plain=plain))

    @app.get("/thumbnail/{key}.jpg")
    def thumbnail(key: str) -> Response:
        return _jpeg(lambda: state.view(key).thumbnail())

    @app.get("/likeness/{key}/{number}/{object_id}.jpg")
    def likeness(key: str, number: int, object_id: int) -> Response:
        return _jpeg(lambda: view_comparison_picture(state.view(key), number, object_id))

    @app.get("/evidence/{key}/{alert}.{kind}")
    def evidence(key: str, alert: int, kind: Literal["jpg", "webm"]) -> Response:
        try:
            files = evidence_of(state.library.folder(key), alert)
        except VisupError as fault:
            raise HTTPException(404, str(fault)) from fault
        path = files.snapshot if kind == "jpg" else files.clip
        if path is None:
            raise HTTPException(404, "There is no such picture or clip (any more).")
        return FileResponse(path, media_type=_MEDIA_TYPES[kind], headers=_IMAGE_HEADERS)


def _jpeg(draw: Callable[[], bytes]) -> Response:
    try:
        return Response(draw(), media_type="image/jpeg", headers=_IMAGE_HEADERS)
    except VisupError as fault:
        raise HTTPException(404, str(fault)) from fault


def _add_pages(state: ConsoleState) -> None:
    @ui.page("/")
    def run_list() -> None:
        library_page(state)

    @ui.page("/wall")
    def wall(request: Request) -> None:
        wall_page(state, _role(request))

    @ui.page("/run/{key}")
    def one_run(request: Request, key: str, t: float = 0.0) -> None:
        run_page(state, key, _role(request), t)


async def _no_such_page(request: Request, fault: Exception) -> Response:
    page = plain_page("Page not found", "There is no such page.", back=True)
    return Response(page, 404, media_type="text/html")


def _role(request: Request) -> ConsoleRole:
    role: ConsoleRole = request.scope.get(ROLE_KEY, ConsoleRole.VIEWER)
    return role


def serve_console(
    state: ConsoleState, access: Access, host: str, port: int, ready: Callable[[str], None]
) -> None:
    """Serve the console until it is interrupted.

    Args:
        state: Shared state of all pages.
        access: Access by tokens and host names.
        host: Address to listen on.
        port: Port; 0 for any free one.
        ready: Receives the address with the token once it listens.

    Raises:
        SettingsError: It cannot listen there.
    """
    application = build_application(state, access)
    with _bound_socket(host, port) as bound:
        actual_port = bound.getsockname()[1]
        name = f"[{host}]" if ":" in host else host
        settings = uvicorn.Config(
            application,
            log_level=logging.WARNING,
            lifespan="on",
            timeout_graceful_shutdown=SHUTDOWN_TIMEOUT_S,
        )
        server = uvicorn.Server(settings)
        ready(f"http://{name}:{actual_port}/?token={access.operator}")
        server.run(sockets=[bound])


def _bound_socket(host: str, port: int) -> socket.socket:
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        sock = socket.socket(family, socket.SOCK_STREAM)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind((host, port))
        sock.listen()  # requests may come as soon as the address is announced
    except (OSError, OverflowError) as fault:
        raise SettingsError(
            f"the console cannot listen at {host}:{port} ({fault})",
            hint="give another --port, or --port 0 for any that is free",
        ) from fault
    return sock
