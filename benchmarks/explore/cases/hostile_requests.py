# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests to a served sweep over plain sockets: without the token, from other pages, damaged, or meaningless."""

from __future__ import annotations

import json
import shutil
import socket
import tempfile
import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.explore.cases import hostile_inputs as hostile
from spectral_core.explore.page.live import LiveSweep
from spectral_core.explore.page.serve import PageServer
from spectral_core.explore.sweep.document import sweep_of
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.sweep import Sweep

_TARGETS = [
    "/page",
    "/api/sample",
    "/api/derive",
    "/api/label",
    "/api/apply",
    "/api/render",
    "/api/status",
    "/api/distance",
]
_GETS = ["/image/../project.json", "/image/%2e%2e/ledger.sqlite", "/image/..%2f..%2f..%2fetc%2fpasswd",
"/project.json", "/data.csv",
         "//etc/passwd", "/image//etc/passwd", "/image/%00.png", "/image/link.png", "/api/status", "/page", "/../x",
         "image/x.png",
         "http://example.com/", "/image/" + "a" * 3000 + ".png", "/image/..\\..\\x.png", "/%", "/image/%ff%fe.png",
         "*"]  # fmt: skip


def measure_requests(count: int) -> dict[str, Any]:
    """Send all requests to one server; counts, and the requests that were wrongly accepted."""
    folder = Path(tempfile.mkdtemp(prefix="hostile-"))
    try:
        return _measured(folder, count)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _measured(folder: Path, count: int) -> dict[str, Any]:
    plain = {
        "compute": {"kind": "function", "function": f"{Path(__file__).with_name('kill.py')}:work",
                    "fixed": {"log": str(folder / "log"), "pause": 0.0}},
        "parameters": [{"name": "a", "low": 0.0, "high": 1.0}, {"name": "b", "low": 0.0, "high": 1.0}],
        "design": {"budget": 5},
    }  # fmt: skip
    sweep = Sweep(sweep_of(plain, folder), folder / "live")
    with ThreadPoolExecutor(1) as threads:
        sweep.run(sweep.plan(), executor=threads)
    (folder / "secret.png").write_bytes(b"secret")
    (sweep.store.folder / "image" / "link.png").symlink_to(folder / "secret.png")
    before = sweep.store.columns()
    applied: list[Any] = []
    tally, wrong = Counter[str](), list[str]()
    with PageServer(LiveSweep(sweep.store, folder, apply=applied.append)) as server:
        server.handle_error = lambda *_: wrong.append("a request ended in an exception")  # type: ignore[method-assign]
        threading.Thread(target=server.serve_forever, daemon=True).start()
        _strangers(server, tally, wrong)
        if sweep.store.columns() != before or applied:
            wrong.append("a stranger changed the sweep")
        _nonsense(server, count, tally, wrong)
        good = _send(server, "POST", "/api/status", b"{}", {"X-Explore-Token": server.token})
        if not good.startswith(b"HTTP/1.1 200"):
            wrong.append("the server does not answer its own page any more")
        server.shutdown()
    sweep.store.write_table()
    sweep.store.close()
    Store.open(folder / "live").close()
    return {**tally, "wrong": wrong[:10]}


def _strangers(server: PageServer, tally: Counter[str], wrong: list[str]) -> None:
    token, own = server.token, f"127.0.0.1:{server.server_port}"
    bad: list[dict[str, str]] = [{}, {"X-Explore-Token": ""}, {"X-Explore-Token": token[:-1]},
        {"X-Explore-Token": token + "x"},
                                 {"X-Explore-Token": "é"}, {"Authorization": f"Bearer {token}"},
                                 {"Cookie": f"token={token}"}]  # fmt: skip
    bad += [{"X-Explore-Token": token, **one} for one in (
        {"Origin": "https://example.com"}, {"Origin": "null"}, {"Origin": f"https://{own}"},
        {"Origin": f"http://{own}.example.com"},
        {"Sec-Fetch-Site": "cross-site"}, {"Sec-Fetch-Site": "same-site"}, {"Host": "example.com"},
        {"Host": f"example.com:{server.server_port}"},
        {"Host": "127.0.0.1"}, {"Host": ""}, {"Origin": ""})]  # fmt: skip
    for headers in bad:
        for target in _TARGETS:
            for path in (target, f"{target}?token={token}"):
                _expect(server, "POST", path, b"{}", headers, (b"403",), tally, wrong)
    picture = next(path.name for path in (server.live.store.folder / "image").iterdir() if not path.is_symlink())
    for headers in ({}, {"X-Explore-Token": "x"}, {"Cookie": f"{server.cookie_name}={token}"}):
        _expect(server, "GET", f"/image/{picture}", b"", headers, (b"403",), tally, wrong)
    for path in _GETS:
        _expect(server, "GET", path, b"", {}, (b"403", b"404", b"400", b"414"), tally, wrong)
    for method in ("PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "PATCH", "HEAD"):
        _expect(server, method, "/api/status", b"{}", {"X-Explore-Token": token}, (b"501", b"405"), tally, wrong)
    sizes = ["-1", "x", "99999999999999999999", "5000001", "1e3", "٣"]
    for size in sizes:
        headers = {"X-Explore-Token": token, "Content-Length": size}
        _expect(server, "POST", "/api/status", b"", headers, (b"413",), tally, wrong)


def _nonsense(server: PageServer, count: int, tally: Counter[str], wrong: list[str]) -> None:
    bodies = [
        b"",
        b"[]",
        b"null",
        b"7",
        b"{",
        b"\xff\xfe",
        b"[" * 100_000,
        b'{"a":' * 50_000,
        b'"x"',
        b"NaN",
        b'{"key": NaN}',
    ]
    for body in bodies:
        for target in _TARGETS:
            if target != "/api/render" and (body != b"" or target not in ("/page", "/api/status")):
                _answered(server, target, body, tally, wrong)
    for action, content in hostile.contents(count):
        _answered(server, f"/api/{action}", json.dumps(content).encode(), tally, wrong)


def _answered(server: PageServer, path: str, body: bytes, tally: Counter[str], wrong: list[str]) -> None:
    """A page with the token may send invalid requests; the answer is a message."""
    tally["tried"] += 1
    said = _send(server, "POST", path, body, {"X-Explore-Token": server.token})
    status = said[9:12]
    if status in (b"400", b"404"):
        tally["refused"] += 1
        if len(json.loads(said.partition(b"\r\n\r\n")[2])["error"]) < 5:
            wrong.append(f"{path} {body[:60]!r}: no words")
    elif status == b"200":
        tally["done, as it made sense"] += 1
    else:
        wrong.append(f"{path} {body[:60]!r}: {said[:80]!r}")


def _expect(
    server: PageServer, method: str, path: str, body: bytes, headers: dict[str, str], statuses: tuple[bytes, ...],
    tally: Counter[str], wrong: list[str],
) -> None:  # fmt: skip
    tally["tried"] += 1
    said = _send(server, method, path, body, headers)
    if said[9:12] in statuses and server.token.encode() not in said and b"secret" not in said:
        tally["refused"] += 1
    else:
        wrong.append(f"{method} {path[:60]} {headers}: {said[:80]!r}")


def _send(server: PageServer, method: str, path: str, body: bytes, headers: dict[str, str]) -> bytes:
    """The complete answer to one request, written to the socket unchanged."""
    given = {
        "Host": f"127.0.0.1:{server.server_port}",
        "Content-Length": str(len(body)),
        "Connection": "close",
        **headers,
    }
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in given.items()), "", ""]
    said = b""
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=20) as link:
        try:
            link.sendall("\r\n".join(lines).encode() + body)
            link.shutdown(socket.SHUT_WR)
            while part := link.recv(65536):
                said += part
        except ConnectionError:
            pass  # an answer that was sent before all was read may end the connection
    return said
