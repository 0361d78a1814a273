# SPDX-License-Identifier: GPL-3.0-or-later
"""A headless Chromium driven over its debugging pipe: open a page, run script in it, press, drag, take pictures."""

from __future__ import annotations

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


class Browser:
    """One page in one browser. Use it in a ``with`` block."""

    def __init__(self, width: int = 1400, height: int = 900, *, dark: bool = False, scale: float = 1.0) -> None:
        path = find_browser()
        if path is None:
            raise FileNotFoundError("no Chromium was found; install one, or name it in the variable CHROMIUM")
        self._profile = tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True)
        to_browser, self._send = _high_pipe()
        self._receive, from_browser = _high_pipe()
        flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-extensions", "--no-first-run",
                 f"--user-data-dir={self._profile.name}", f"--window-size={width},{height}",
                 f"--force-device-scale-factor={scale}", "--remote-debugging-pipe"]  # fmt: skip
        # the browser reads commands from descriptor 3 and writes answers to 4
        script = f'exec 3<&{to_browser} 4>&{from_browser}; exec "$0" "$@"'
        self.process = subprocess.Popen(
            ["bash", "-c", script, path, *flags], pass_fds=(to_browser, from_browser), stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(to_browser)
        os.close(from_browser)
        self._buffer = b""
        self._number = 0
        self.errors: list[str] = []
        self.requests: list[str] = []
        self._events: list[dict[str, Any]] = []
        try:
            self._attach(width, height, dark=dark, scale=scale)
        except BaseException:
            self.close()
            raise

    def _attach(self, width: int, height: int, *, dark: bool, scale: float) -> None:
        target = self._call("Target.createTarget", {"url": "about:blank"})["targetId"]
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
        """End the browser."""
        self.process.kill()
        self.process.wait()
        os.close(self._send)
        os.close(self._receive)
        self._profile.cleanup()

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
        self._number += 1
        number = self._number
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters or {}}
        if session:
            message["sessionId"] = session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._send, data) :]
        while True:
            found = self._take()
            if found.get("id") == number:
                if "error" in found:
                    raise RuntimeError(f"{method}: {found['error']}")
                return found["result"]

    def _take(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            if not select.select([self._receive], [], [], ANSWER_LIMIT_S)[0]:
                raise TimeoutError(f"the browser did not answer within {ANSWER_LIMIT_S:g} s")
            part = os.read(self._receive, 1 << 20)
            if not part:
                raise EOFError("the browser is gone")
            self._buffer += part
        head, _, self._buffer = self._buffer.partition(b"\0")
        message: dict[str, Any] = json.loads(head)
        if message.get("method") == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(message["params"])[:1000])
        if message.get("method") == "Network.requestWillBeSent":
            self.requests.append(message["params"]["request"]["url"])
        if "method" in message:
            self._events.append(message)
        return message
