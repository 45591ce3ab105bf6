"""A real browser without a window, driven through its debugging pipe: mouse, keys, and what a page shows.

Chromium speaks its protocol on file descriptors 3 and 4, messages of JSON ended by a zero byte, so that the
standard library is enough.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import pytest

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
PATIENCE_S = 20.0
# The browser reads commands at 3 and writes answers at 4, whatever stands there in this process.
WIRED = (
    "import fcntl, os, sys; "
    "ends = [fcntl.fcntl(int(n), fcntl.F_DUPFD, 20) for n in sys.argv[1:3]]; "
    "[os.dup2(end, n) for n, end in enumerate(ends, start=3)]; "
    "os.execv(sys.argv[3], sys.argv[3:])"
)
KEYS = {"Enter": 13, "Escape": 27, "Backspace": 8, "Tab": 9, " ": 32}
KEYS |= {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}


def found_browser() -> str:
    """The browser's program; the test is skipped where there is none."""
    for name in PROGRAMS:
        if (path := shutil.which(name)) is not None:
            return path
    pytest.skip(f"no browser is installed (one of {', '.join(PROGRAMS)})")


class Browser:
    """One page in a browser without a window."""

    def __init__(self, folder: Path, size: tuple[int, int] = (1200, 800)) -> None:
        down, up = os.pipe(), os.pipe()
        command = [
            *(found_browser(), "--headless=new", "--remote-debugging-pipe", "--no-sandbox"),
            *("--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--disable-extensions"),
            *(f"--user-data-dir={folder}", f"--window-size={size[0]},{size[1]}", "about:blank"),
        ]
        wired = [sys.executable, "-c", WIRED, str(down[0]), str(up[1]), *command]
        self._process = subprocess.Popen(
            wired,
            pass_fds=(down[0], up[1]),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(down[0])
        os.close(up[1])
        self._write, self._read = down[1], up[0]
        self._left, self._count, self._session, self._target = b"", 0, "", ""
        self.new_page()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.close(self._write)  # a browser whose pipe is closed ends
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._read)

    def new_page(self) -> None:
        """Close the page and begin a new one, as another user would: without cookies and stored data.

        What was loaded from a server stays in the cache, where the server allows it.
        """
        old, self._session = self._target, ""
        self._target = self.call("Target.createTarget", url="about:blank")["targetId"]
        if old:
            self.call("Target.closeTarget", targetId=old)
        attached = self.call("Target.attachToTarget", targetId=self._target, flatten=True)
        self._session = attached["sessionId"]
        self.call("Storage.clearDataForOrigin", origin="*", storageTypes="all")
        self.call("Page.enable")
        self.call("Runtime.enable")

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Ask the browser for something, and wait for its answer."""
        self._count += 1
        asked = {"id": self._count, "method": method, "params": params}
        if self._session:
            asked["sessionId"] = self._session
        os.write(self._write, json.dumps(asked).encode() + b"\0")
        end = time.monotonic() + PATIENCE_S
        while True:
            answer = self._message(end)
            if answer.get("id") == self._count:
                assert "error" not in answer, answer["error"]
                return dict(answer["result"])

    def _message(self, end: float) -> dict[str, Any]:
        while b"\0" not in self._left:
            ready, _, _ = select.select([self._read], [], [], max(0.0, end - time.monotonic()))
            assert ready, "the browser does not answer"
            data = os.read(self._read, 1 << 16)
            assert data, "the browser has ended"
            self._left += data
        message, _, self._left = self._left.partition(b"\0")
        return dict(json.loads(message))

    def open(self, url: str) -> None:
        """Go to a page."""
        self.call("Page.navigate", url=url)

    def value(self, script: str) -> Any:
        """What a script gives in the page."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def until(self, script: str) -> Any:
        """Wait until a script gives something that is true."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            if found := self.value(script):
                return found
            time.sleep(0.02)
        raise AssertionError(f"never true: {script}")

    def settled(self, script: str) -> Any:
        """What a script gives once it has stayed the same for half a second."""
        value, same = self.value(script), 0
        while same < 5:
            time.sleep(0.1)
            before, value = value, self.value(script)
            same = same + 1 if value == before else 0
        return value

    def move(self, x: float, y: float) -> None:
        """Move the pointer to a place."""
        self._mouse("mouseMoved", x, y, 0)

    def click(self, x: float, y: float, count: int = 1) -> None:
        """Click at a place of the window; a double click is two clicks."""
        self._mouse("mouseMoved", x, y, 0)
        for number in range(1, count + 1):
            self._mouse("mousePressed", x, y, number)
            self._mouse("mouseReleased", x, y, number)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Press at one place and let go at another."""
        self._mouse("mouseMoved", *start, 0)
        self._mouse("mousePressed", *start, 1)
        self._mouse("mouseMoved", *end, 1)
        self._mouse("mouseReleased", *end, 1)

    def _mouse(self, kind: str, x: float, y: float, count: int) -> None:
        button = "none" if kind == "mouseMoved" and not count else "left"
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, clickCount=count)

    def wheel(self, x: float, y: float, by: float) -> None:
        """Turn the wheel over a place."""
        self.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=by)

    def press(self, *keys: str, shift: bool = False) -> None:
        """Press keys one after the other."""
        for key in keys:
            code = KEYS.get(key, ord(key.upper()) if len(key) == 1 else 0)
            answer = {"key": key, "windowsVirtualKeyCode": code, "modifiers": 8 if shift else 0}
            text = (
                {"text": "\r" if key == "Enter" else key} if len(key) == 1 or key == "Enter" else {}
            )
            self.call("Input.dispatchKeyEvent", type="keyDown", **answer, **text)
            self.call("Input.dispatchKeyEvent", type="keyUp", **answer)

    def type(self, text: str) -> None:
        """Type into whatever has the focus."""
        self.call("Input.insertText", text=text)

    def press_button(self, id: str) -> None:
        """Click a button where it stands in the window."""
        box = self.value(
            f"(() => {{ const e = document.getElementById('{id}'); e.scrollIntoView();"
            "const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )
        self.click(*box)

    def picture(self, path: Path) -> None:
        """Write what the window shows as PNG."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))
