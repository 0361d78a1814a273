# SPDX-License-Identifier: GPL-3.0-or-later
"""The live page: a server on 127.0.0.1 that answers only holders of its token, and only its own page.

The token is in the fragment of the address, which a browser does not send. A request without it, from another
origin or for another host is refused, so that no page of the web can reach the sweep through the browser.
"""

from __future__ import annotations

import hmac
import json
import mimetypes
import secrets
from http.cookies import CookieError, SimpleCookie
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from spectral_core.checks import require_whole
from spectral_core.errors import InvalidInputError, SpectralError
from spectral_core.explore.page.build import page_html, table_of_store
from spectral_core.explore.page.live import LiveSweep
from spectral_core.explore.sweep.files import inside

MAX_BODY_BYTES = 5_000_000
PICTURE_ENDINGS = (".png", ".jpg", ".jpeg", ".webp")


class PageServer(ThreadingHTTPServer):
    """Serves one sweep on 127.0.0.1; ``address`` holds the token."""

    daemon_threads = True

    def __init__(self, live: LiveSweep, port: int = 0) -> None:
        port = require_whole("the port", port, 0, 65535)
        try:
            super().__init__(("127.0.0.1", port), _Handler)
        except OSError as error:
            raise InvalidInputError(
                f"port {port} cannot be used: {error.strerror}; choose another port, or 0 for a free one"
            ) from error
        self.live = live
        self.token = secrets.token_urlsafe(32)
        self.picture_secret = secrets.token_urlsafe(32)

    @property
    def address(self) -> str:
        """Address to open in a browser."""
        return f"http://127.0.0.1:{self.server_port}/#token={self.token}"

    @property
    def cookie_name(self) -> str:
        """Cookies belong to a host, not to a port: two servers must not overwrite each other's."""
        return f"explore-{self.server_port}"

    @property
    def hosts(self) -> tuple[str, ...]:
        """Host names of valid requests."""
        return f"127.0.0.1:{self.server_port}", f"localhost:{self.server_port}"


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    protocol_version = "HTTP/1.1"
    timeout = 60

    def do_GET(self) -> None:
        """The page without its data needs no secret; its pictures need the cookie that came with the data."""
        if not self._own_host():
            return self._refuse(403, "this host is not served")
        if self._foreign_origin():
            return self._refuse(403, "requests from other origins are refused")
        path = self.path.partition("?")[0]
        if path == "/":
            return self._send(200, "text/html; charset=utf-8", _GATE.encode())
        if path.startswith("/image/"):
            if not (self._has_token() or self._has_cookie()):
                return self._refuse(403, "the token is missing or wrong; open the address that was printed")
            return self._picture(path[1:])
        return self._refuse(404, "there is no such page")

    def do_POST(self) -> None:
        if not self._own_host() or self._foreign_origin():
            return self._refuse(403, "requests from other origins are refused")
        if not self._has_token():
            return self._refuse(403, "the token is missing or wrong; open the address that was printed")
        try:
            length = int(self.headers.get("Content-Length", ""))
        except ValueError:
            length = -1
        if not 0 <= length <= MAX_BODY_BYTES:
            self.close_connection = True
            return self._refuse(413, f"a request holds at most {MAX_BODY_BYTES:,} bytes")
        try:
            content = json.loads(self.rfile.read(length) or b"{}")
        except (ValueError, RecursionError):
            return self._refuse(400, "the request is not JSON")
        if not isinstance(content, dict):
            return self._refuse(400, "the request is no JSON object")
        if self.path == "/page":
            try:
                self.server.live.store.refresh()
                page = page_html(table_of_store(self.server.live.store), live=True)
            except SpectralError as error:  # such as a sweep without a finished row
                return self._refuse(400, str(error))
            # An img element cannot send the token, so a cookie that is valid for pictures alone replaces it.
            cookie = f"{self.server.cookie_name}={self.server.picture_secret}; HttpOnly; SameSite=Strict; Path=/image"
            return self._send(200, "text/html; charset=utf-8", page.encode(), cookie)
        action = (
            self.server.live.actions.get(self.path.removeprefix("/api/")) if self.path.startswith("/api/") else None
        )
        if action is None:
            return self._refuse(404, "there is no such action")
        try:
            self.server.live.store.refresh()
            self._json(200, action(content))
        except (SpectralError, KeyError, TypeError, ValueError, AttributeError, OverflowError, OSError) as error:
            self._refuse(400, str(error) or f"the request cannot be carried out ({type(error).__name__})")

    def _own_host(self) -> bool:
        """True if the request names this address: other names that resolve to it (DNS rebinding) are refused."""
        return self.headers.get("Host", "") in self.server.hosts

    def _foreign_origin(self) -> bool:
        origin = self.headers.get("Origin")
        site = self.headers.get("Sec-Fetch-Site")
        if origin is not None and origin not in {f"http://{host}" for host in self.server.hosts}:
            return True
        return site is not None and site not in ("same-origin", "none")

    def _has_token(self) -> bool:
        given = self.headers.get("X-Explore-Token", "")
        return hmac.compare_digest(given.encode("utf-8", "replace"), self.server.token.encode())

    def _has_cookie(self) -> bool:
        try:
            given = SimpleCookie(self.headers.get("Cookie", "")).get(self.server.cookie_name)
        except CookieError:
            return False
        value = "" if given is None else given.value
        return hmac.compare_digest(value.encode("utf-8", "replace"), self.server.picture_secret.encode())

    def _picture(self, name: str) -> None:
        from urllib.parse import unquote

        try:
            path = inside(self.server.live.store.folder, unquote(name))
            known = path.suffix.lower() in PICTURE_ENDINGS and path.parent.name == "image" and path.is_file()
        except InvalidInputError as error:
            return self._refuse(403, str(error))
        except OSError:  # a name that the file system does not take
            known = False
        if not known:
            return self._refuse(404, "there is no such picture")
        return self._send(200, mimetypes.guess_type(path.name)[0] or "image/png", path.read_bytes())

    def _json(self, status: int, content: dict[str, Any]) -> None:
        self._send(status, "application/json", json.dumps(content).encode())

    def _refuse(self, status: int, message: str) -> None:
        self._json(status, {"error": message})

    def _send(self, status: int, kind: str, body: bytes, cookie: str = "") -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        if cookie:
            self.send_header("Set-Cookie", cookie)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Cross-Origin-Resource-Policy", "same-origin")
        self.send_header("X-Frame-Options", "DENY")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *arguments: Any) -> None:
        """Do not log requests."""


_GATE = """<!doctype html><meta charset="utf-8"><title>Exploration</title>
<p id="said">Opening …</p><script>
const token = new URLSearchParams(location.hash.slice(1)).get("token") || "";
fetch("page", {method: "POST", headers: {"X-Explore-Token": token}, body: "{}"}).then(async answer => {
  const text = await answer.text();
  if (!answer.ok) { document.getElementById("said").textContent = JSON.parse(text).error; return; }
  document.open(); document.write(text); document.close();
});
</script>"""
"""Public page that fetches the real one with the token in its address."""
