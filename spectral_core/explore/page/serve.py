# SPDX-License-Identifier: GPL-3.0-or-later
"""The live page: a server on 127.0.0.1 that answers only who holds its token, and only its own page.

The token stands in the fragment of the address, which a browser keeps to itself. A request without it, from another
origin or for another host is refused, so that no page of the web can reach the sweep through the browser.
"""

from __future__ import annotations

import hmac
import json
import mimetypes
import secrets
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from spectral_core.errors import InvalidInputError, SpectralError
from spectral_core.explore.page.build import page_html, table_of_store
from spectral_core.explore.sweep.document import compute_node
from spectral_core.explore.sweep.files import inside
from spectral_core.explore.sweep.region import RegionOfInterest
from spectral_core.explore.sweep.store import Store

MAX_BODY_BYTES = 5_000_000
MAX_SAMPLE = 10_000
PICTURE_ENDINGS = (".png", ".jpg", ".jpeg", ".webp")
Action = Callable[[Mapping[str, Any]], dict[str, Any]]


class LiveSweep:
    """What the page may do with a sweep.

    Parameters
    ----------
    store : the open store.
    folder : where the sweep's file lies, for the compute node; None where points cannot be computed.
    workers : processes for renders.
    apply : called with the parameters of a point, to set the open scene to it; None where there is none.
    render : computes what is missing in its own way and says so; None: processes of this one do.
    """

    def __init__(
        self,
        store: Store,
        folder: Any = None,
        *,
        workers: int = 1,
        apply: Callable[[Mapping[str, Any]], None] | None = None,
        render: Callable[[], str] | None = None,
    ) -> None:
        self.store, self.folder, self.workers = store, folder, workers
        self._apply, self._render = apply, render
        self._busy = threading.Lock()
        self._status = ""
        self._background = ThreadPoolExecutor(1)

    @property
    def actions(self) -> dict[str, Action]:
        """Actions by name."""
        return {
            name: getattr(self, name)
            for name in ("sample", "refine", "render", "derive", "distance", "label", "apply", "status")
        }

    def sample(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Add points to a region."""
        region = RegionOfInterest.from_dict(dict(content.get("region") or {}))
        budget = content.get("budget")
        if isinstance(budget, bool) or not isinstance(budget, int) or not 1 <= budget <= MAX_SAMPLE:
            raise InvalidInputError(f"the number of points is {budget!r}; expected 1 to {MAX_SAMPLE}")
        project = self.store.project
        region.checked(project.space)
        known = self.store.known_points()
        inside_now = sum(region.contains(project.space, point) for point in known)
        return self._add(region, inside_now + budget)

    def refine(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Twice as many points in the sweep's region."""
        project = self.store.project
        project.design = replace(project.design, budget=2 * project.design.budget)
        answer = self._add(project.region, project.design.budget)
        self.store.save_project()
        return answer

    def _add(self, region: RegionOfInterest, budget: int) -> dict[str, Any]:
        from spectral_core.explore.sweep.designs import design_points

        project = self.store.project
        design = replace(project.design, budget=budget)
        points, notes = design_points(project.space, region, design, known=self.store.known_points())
        new = self.store.enter(points)
        return {"message": "; ".join([f"{new} points added; press Render to compute them", *notes]), "new": new}

    def render(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Compute what is missing, in the background."""
        from spectral_core.explore.sweep.runner import run_sweep

        if self._render is not None:
            return {"message": self._render()}
        if self.folder is None:
            raise InvalidInputError("this sweep cannot be computed here; run it with spectral-scene sweep")
        node = compute_node(self.store.project.compute, self.store.project.space, self.folder)
        if not self._busy.acquire(blocking=False):
            raise InvalidInputError(f"a run is on its way: {self._status}")

        def work() -> None:
            try:
                report = run_sweep(self.store, node, workers=self.workers, on_progress=self._note)
                self._status = f"{report.computed} computed, {len(report.failures)} set aside; reload to see them"
            except Exception as error:
                self._status = f"the run failed: {error}"
            finally:
                self._busy.release()

        self._status = "started"
        self._background.submit(work)
        return {"message": "computing in the background; reload the page to see new points"}

    def _note(self, progress: Any) -> None:
        self._status = f"{progress.done} of {progress.total} done"

    def derive(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Add a column."""
        self.store.derive(str(content.get("name", "")), str(content.get("expression", "")))
        self.store.write_table()
        return {"message": "column added", "reload": True}

    def distance(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Add the column of distances to a row."""
        from spectral_core.explore.analysis.steps import add_distance

        weights, p = content.get("weights"), content.get("p", 2)
        if not isinstance(weights, dict) or isinstance(p, bool) or not isinstance(p, int | float | str):
            raise InvalidInputError("a distance needs weights, a mapping from columns to numbers, and a number p")
        name = str(content.get("name", "distance"))
        count = add_distance(self.store, str(content.get("key", "")), weights, float(p), name)
        self.store.write_table()
        return {"message": f"{count} rows measured: column {name}", "reload": True}

    def label(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Set a manual column."""
        values = content.get("values")
        if not isinstance(values, dict):
            raise InvalidInputError("labels are a mapping from rows to texts")
        self.store.label(str(content.get("name", "")), values)
        self.store.write_table()
        return {"message": f"{len(values)} rows labeled"}

    def apply(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Set the open scene to a point."""
        if self._apply is None:
            raise InvalidInputError("no scene is open here; serve the page from Blender's Sweep panel")
        rows = {row.key: row for row in self.store.ledger.rows()}
        key = content.get("key")
        if key not in rows:
            raise InvalidInputError("the sweep has no such row")
        self._apply(rows[key].parameters)
        return {"message": "the scene is set to this point"}

    def status(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """How far the run in the background is."""
        return {"message": self._status or "nothing runs"}


class PageServer(ThreadingHTTPServer):
    """Serves one sweep on 127.0.0.1; ``address`` holds the token."""

    daemon_threads = True

    def __init__(self, live: LiveSweep, port: int = 0) -> None:
        super().__init__(("127.0.0.1", port), _Handler)
        self.live = live
        self.token = secrets.token_urlsafe(32)

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"http://127.0.0.1:{self.server_port}/#token={self.token}"

    @property
    def hosts(self) -> tuple[str, ...]:
        """Names under which the page may ask."""
        return f"127.0.0.1:{self.server_port}", f"localhost:{self.server_port}"


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    protocol_version = "HTTP/1.1"
    timeout = 60

    def do_GET(self) -> None:
        """The page without its data needs no secret; the pictures are only sent to the page itself."""
        if not self._own_host():
            return self._refuse(403, "this host is not served")
        if self._foreign_origin():
            return self._refuse(403, "requests from other origins are refused")
        path = self.path.partition("?")[0]
        if path == "/":
            return self._send(200, "text/html; charset=utf-8", _GATE.encode())
        if path.startswith("/image/"):
            return self._picture(path[1:])
        return self._refuse(404, "there is no such page")

    def do_POST(self) -> None:
        if not self._own_host() or self._foreign_origin():
            return self._refuse(403, "requests from other origins are refused")
        given = self.headers.get("X-Explore-Token", "")
        if not hmac.compare_digest(given.encode("utf-8", "replace"), self.server.token.encode()):
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
                page = page_html(table_of_store(self.server.live.store), live=True)
            except SpectralError as error:  # such as a sweep without a finished row
                return self._refuse(400, str(error))
            return self._send(200, "text/html; charset=utf-8", page.encode())
        action = (
            self.server.live.actions.get(self.path.removeprefix("/api/")) if self.path.startswith("/api/") else None
        )
        if action is None:
            return self._refuse(404, "there is no such action")
        try:
            self._json(200, action(content))
        except (SpectralError, KeyError, TypeError, ValueError, AttributeError, OverflowError, OSError) as error:
            self._refuse(400, str(error) or f"the request cannot be carried out ({type(error).__name__})")

    def _own_host(self) -> bool:
        """Whether the browser was told this very address: names that lead here (DNS rebinding) are refused."""
        return self.headers.get("Host", "") in self.server.hosts

    def _foreign_origin(self) -> bool:
        origin = self.headers.get("Origin")
        site = self.headers.get("Sec-Fetch-Site")
        if origin is not None and origin not in {f"http://{host}" for host in self.server.hosts}:
            return True
        return site is not None and site not in ("same-origin", "none")

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

    def _send(self, status: int, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Cross-Origin-Resource-Policy", "same-origin")
        self.send_header("X-Frame-Options", "DENY")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *arguments: Any) -> None:
        """Say nothing per request."""


_GATE = """<!doctype html><meta charset="utf-8"><title>Exploration</title>
<p id="said">Opening …</p><script>
const token = new URLSearchParams(location.hash.slice(1)).get("token") || "";
fetch("page", {method: "POST", headers: {"X-Explore-Token": token}, body: "{}"}).then(async answer => {
  const text = await answer.text();
  if (!answer.ok) { document.getElementById("said").textContent = JSON.parse(text).error; return; }
  document.open(); document.write(text); document.close();
});
</script>"""
"""The page that anyone may load: it fetches the real one with the token of its address."""
