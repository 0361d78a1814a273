# SPDX-License-Identifier: GPL-3.0-or-later
"""A headless Chromium driven over its debugging pipe: open a page, run script in it, press, drag, take pictures."""

from __future__ import annotations

import atexit
import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

ANSWER_LIMIT_S = 20.0
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")


def find_browser() -> str | None:
    """Path of a Chromium, None if there is none; the variable CHROMIUM names another one."""
    named = os.environ.get("CHROMIUM")
    return named or next((path for name in NAMES if (path := shutil.which(name))), None)


def _high_pipe() -> tuple[int, int]:
    """A pipe whose descriptors differ from all of those that the browser gets."""
    import fcntl

    low = os.pipe()
    high = tuple(fcntl.fcntl(each, fcntl.F_DUPFD, 20) for each in low)
    for each in low:
        os.close(each)
    return high[0], high[1]


class Chromium:
    """A headless Chromium that several pages share, as a start takes longer than most checks of a page."""

    _running: Chromium | None = None

    def __init__(self) -> None:
        path = find_browser()
        if path is None:
            raise FileNotFoundError("no Chromium was found; install one, or name it in the variable CHROMIUM")
        self._profile = tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True)
        to_browser, self.send = _high_pipe()
        self.receive, from_browser = _high_pipe()
        flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-extensions", "--no-first-run",
                 f"--user-data-dir={self._profile.name}", "--remote-debugging-pipe"]  # fmt: skip
        # the browser reads commands from descriptor 3 and writes answers to 4
        script = f'exec 3<&{to_browser} 4>&{from_browser}; exec "$0" "$@"'
        self.process = subprocess.Popen(
            ["bash", "-c", script, path, *flags], pass_fds=(to_browser, from_browser), stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(to_browser)
        os.close(from_browser)
        self.buffer = b""
        self.number = 0
        atexit.register(self.close)

    @classmethod
    def running(cls) -> Chromium:
        """The browser of this process, which ends with it; another one if that is gone."""
        if cls._running is None or cls._running.process.poll() is not None:
            if cls._running is not None:
                cls._running.close()
            cls._running = cls()
        return cls._running

    def close(self) -> None:
        """End the browser."""
        atexit.unregister(self.close)
        if Chromium._running is self:
            Chromium._running = None
        self.process.kill()
        self.process.wait()
        os.close(self.send)
        os.close(self.receive)
        self._profile.cleanup()


class Browser:
    """One page with its own cookies and storage, in a browser that is shared. Use it in a ``with`` block."""

    def __init__(self, width: int = 1400, height: int = 900, *, dark: bool = False, scale: float = 1.0) -> None:
        self._session: str | None = None
        self.errors: list[str] = []
        self.requests: list[str] = []
        self._events: list[dict[str, Any]] = []
        self._chromium = Chromium.running()
        try:
            self._attach(width, height, dark=dark, scale=scale)
        except BaseException:
            self._chromium.close()
            raise

    def _attach(self, width: int, height: int, *, dark: bool, scale: float) -> None:
        self._context = self._call("Target.createBrowserContext")["browserContextId"]
        place = {"url": "about:blank", "browserContextId": self._context, "width": width, "height": height}
        target = self._call("Target.createTarget", place)["targetId"]
        self._session = self._call("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride",
                  {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": width < 600})  # fmt: skip
        if dark:
            self.call("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark"}]})

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the page; a browser that does not answer is ended, and the next page gets another one."""
        if Chromium._running is not self._chromium:
            return
        try:
            self._call("Target.disposeBrowserContext", {"browserContextId": self._context})
        except (OSError, EOFError, RuntimeError):  # a TimeoutError is an OSError
            self._chromium.close()

    def call(self, method: str, parameters: dict[str, Any] | None = None) -> dict[str, Any]:
        """Call a method of the DevTools protocol for the page."""
        return self._call(method, parameters, self._session)

    def open(self, address: str) -> None:
        """Load a page and wait until it is loaded."""
        self._events.clear()
        self.call("Page.navigate", {"url": address})
        while not any(event.get("method") == "Page.loadEventFired" for event in self._events):
            self._take()
        self.run("new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))")

    def run(self, script: str) -> Any:
        """Value of an expression in the page; promises are awaited. Raises RuntimeError with the page's error."""
        said = self.call("Runtime.evaluate", {"expression": script, "awaitPromise": True, "returnByValue": True})
        if "exceptionDetails" in said:
            raise RuntimeError(json.dumps(said["exceptionDetails"])[:2000])
        return said["result"].get("value")

    def drag(self, path: list[tuple[float, float]]) -> None:
        """Press at the first position, move over the others, release at the last."""
        for number, (x, y) in enumerate(path):
            kind = "mousePressed" if number == 0 else "mouseMoved"
            self._mouse(kind, x, y)
        self._mouse("mouseReleased", *path[-1])

    def click(self, x: float, y: float) -> None:
        """Click at a position."""
        self.drag([(x, y)])

    def _mouse(self, kind: str, x: float, y: float) -> None:
        self.call("Input.dispatchMouseEvent",
                  {"type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1})  # fmt: skip

    def touch(self, path: list[tuple[float, float]]) -> None:
        """The same with a finger."""
        for number, (x, y) in enumerate(path):
            kind = "touchStart" if number == 0 else "touchMove"
            self.call("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y}]})
        self.call("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def key(self, key: str) -> None:
        """Press and release a key."""
        for kind in ("keyDown", "keyUp"):
            text = {"text": key} if len(key) == 1 and kind == "keyDown" else {}
            self.call("Input.dispatchKeyEvent", {"type": kind, "key": key, **text})

    def picture(self, path: Path) -> Path:
        """Write a PNG of the window."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", {"format": "png"})["data"]))
        return path

    def _call(self, method: str, parameters: dict[str, Any] | None = None, session: str | None = None) -> Any:
        self._chromium.number += 1
        number = self._chromium.number
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters or {}}
        if session:
            message["sessionId"] = session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._chromium.send, data) :]
        while True:
            found = self._take()
            if found.get("id") == number:
                if "error" in found:
                    raise RuntimeError(f"{method}: {found['error']}")
                return found["result"]

    def _take(self) -> dict[str, Any]:
        browser = self._chromium
        while b"\0" not in browser.buffer:
            if not select.select([browser.receive], [], [], ANSWER_LIMIT_S)[0]:
                raise TimeoutError(f"the browser did not answer within {ANSWER_LIMIT_S:g} s")
            part = os.read(browser.receive, 1 << 20)
            if not part:
                raise EOFError("the browser is gone")
            browser.buffer += part
        head, _, browser.buffer = browser.buffer.partition(b"\0")
        message: dict[str, Any] = json.loads(head)
        if "method" not in message or message.get("sessionId") != self._session:
            return message  # an answer, or an event of the browser or of a page that is closed
        if message["method"] == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(message["params"])[:1000])
        if message["method"] == "Network.requestWillBeSent":
            self.requests.append(message["params"]["request"]["url"])
        self._events.append(message)
        return message
