# SPDX-License-Identifier: GPL-3.0-or-later
"""Each option of a command changes what the command prints or writes; the parser says which options there are."""

from __future__ import annotations

import argparse
import hashlib
import importlib
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core import cli
from spectral_core.explore.page import serve
from spectral_core.palette.recipe.library import led_channels
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.transport import Transport
from spectral_core.render.relight.transport_file import write_transport
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.files import write_spectra

FUNCTION = Path(__file__).parents[1] / "explore" / "functions.py"
COMPUTE = """
[compute]
kind = "function"
function = "{function}"
[design]
kind = "lattice"
budget = {budget}
[[parameters]]
name = "a"
low = 0.0
high = 1.0
[[parameters]]
name = "b"
low = 0.0
high = 1.0
"""
Words = list[str]
CASES: dict[str, tuple[Words, dict[str, tuple[Words, Words]]]] = {
    "lattice": (["--dims", "2", "--points", "12"], {
        "dims": ([], ["--dims", "3"]),
        "rate": ([], ["--rate", "3"]),
        "points": ([], ["--points", "13"]),
        "low": ([], ["--low", "-1"]),
        "high": ([], ["--high", "2"]),
        "ball": ([], ["--ball", "1.5"]),
        "simplex": ([], ["--simplex"]),
        "refine": ([], ["--refine", "1"]),
        "latin": ([], ["--latin"]),
        "criterion": ([], ["--criterion", "unit"]),
        "seed": ([], ["--seed", "1"]),
        "out": ([], ["--out", "points.csv"]),
        "plot": ([], ["--plot", "pictures"]),
    }),
    "explore": (["sweep"], {
        "folder": ([], ["other"]),
        "out": ([], ["--out", "page.html"]),
        "no_thumbnails": ([], ["--no-thumbnails"]),
        "figure": ([], ["--figure", "matrix.png"]),
        "columns": (["--figure", "matrix.png"], ["--columns", "a", "b"]),
        "color": (["--figure", "matrix.png", "--columns", "a", "b"], ["--color", "b"]),
        "error_time": (["--figure", "matrix.png", "--columns", "a", "mean"], ["--error-time", "time.png"]),
        "by": (["--columns", "mean", "--error-time", "time.png"], ["--by", "a"]),
        "time": (["--columns", "mean", "--error-time", "time.png"], ["--time", "b"]),
        "derive": ([], ["--derive", "twice", "2 * mean"]),
        "reference": ([], ["--reference", "KEY"]),
        "distance": ([], ["sweep", "--distance", "KEY", "--weights", "mean=1"]),
        "weights": (["--distance", "KEY", "--weights", "mean=1"], ["--weights", "a=1", "b=2"]),
        "norm": (["--distance", "KEY", "--weights", "a=1", "b=2"], ["--norm", "1"]),
        "embed": ([], ["--embed", "gaussian"]),
        "clusters": ([], ["--clusters", "3"]),
        "sensitivity": ([], ["--sensitivity", "mean"]),
        "propose": ([], ["--propose", "mean"]),
        "region": ([], ["--region", "kind", "good"]),
        "serve": ([], ["--serve"]),
        "port": (["--serve"], ["--port", "1234"]),
        "workers": (["--serve"], ["--workers", "2"]),
    }),
    "relight": (["lights.exr", "--out", "picture.npy"], {
        "transport": ([], ["others.exr", "--out", "picture.npy"]),
        "light": ([], ["--light", "key=A"]),
        "mix": ([], ["--mix", "key=0.3"]),
        "dial": ([], ["--dial", "0,1"]),
        "frames": (["--dial", "0,1;0,-1", "--frames", "2"], ["--frames", "3"]),
        "out": ([], ["--out", "other.npy"]),
        "html": ([], ["--html", "page.html"]),
    }),
    "sweep": (["sweep.toml"], {
        "sweep": (["--plan"], ["larger.toml", "--plan"]),
        "out": ([], ["--out", "elsewhere.cdb"]),
        "budget": (["--plan"], ["--budget", "9"]),
        "plan": ([], ["--plan"]),
        "pending": (["--out", "other", "--plan"], ["--pending"]),
        "workers": ([], ["--workers", "2"]),
        "retry": (["--collect"], ["--retry"]),
        "shell": ([], ["--shell", "2"]),
        "share": ([], ["--share", "1/2"]),
        "collect": ([], ["--collect"]),
    }),
}  # fmt: skip
"""Arguments of each command; for each option the arguments that it needs, and its own, or all of another call."""
LAMP = ["lamp", "lamps.csv", "--cct", "4000"]
GOOD = [*LAMP, "--cri", "95", "--most", "3"]
INKS = ["inks", "surfaces.csv", "--target", "foliage"]
CASES |= {
    "mix": (["red:1", "blue:2"], {
        "parts": ([], ["red:1", "blue:3"]),
        "law": ([], ["--law", "additive"]),
        "light": ([], ["--light", "A"]),
        "out": ([], ["--out", "mixture.csv"]),
    }),
    "light_model": (["--surface", "red", "--surface", "blue"], {
        "light": ([], ["--light", "A"]),
        "surface": ([], ["--surface", "foliage"]),
        "keep": (["--out", "model.json"], ["--keep", "7 nodes"]),
        "out": ([], ["--out", "model.json"]),
    }),
    "recipe": ([], {
        "kind": (["inks", "surfaces.csv", "--target", "foliage"], ["filters", "surfaces.csv", "--target", "foliage"]),
        "spectra": (LAMP, ["lamp", "others.csv", "--cct", "4000"]),
        "most": (GOOD, ["--most", "4"]),
        "cct": (LAMP, ["--cct", "5000"]),
        "duv": (LAMP, ["--duv", "0.004"]),
        "cri": (LAMP, ["--cri", "95"]),
        "rf": (LAMP, ["--rf", "96"]),
        "rg": (LAMP, ["--rg", "104", "106"]),
        "cct_tolerance": (GOOD, ["--cct-tolerance", "300"]),
        "duv_tolerance": (GOOD, ["--duv-tolerance", "0.008"]),
        "target": (INKS, ["--target", "orange"]),
        "light": (INKS, ["--light", "FL2"]),
        "paper": (INKS, ["--paper", "white 9.5 (.05 D)"]),
        "dot_gain": (INKS, ["--dot-gain", "1.5"]),
        "grams": (["paints", *INKS[1:]], ["--grams", "50"]),
    }),
}  # fmt: skip
ELSEWHERE = {"sweep": {"dask"}}
"""Options that need a cluster."""


class Report:
    """In place of the report of a run: all figures are the number of workers."""

    failures: dict[str, str] = {}
    cancelled = False
    not_compared = ""
    not_computed: dict[str, str] = {}
    not_finite: dict[str, int] = {}

    def __init__(self, _sweep: Any, _plan: Any, *, workers: int, **_options: Any) -> None:
        self.workers = workers

    def reasons(self) -> Words:
        return []

    def __getattr__(self, name: str) -> int:
        return int(self.workers)


class Server:
    """In place of the server of a page: it says its port and its number of workers, and stops."""

    def __init__(self, sweep: Any, port: int) -> None:
        self.address = f"port {port}, {sweep.workers} workers"

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_error: object) -> None:
        return None

    def serve_forever(self) -> None:
        return None


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder with the inputs of all commands, and the key of one row of its sweep."""
    from spectral_core.explore.sweep.store import Store

    folder = tmp_path_factory.mktemp("inputs")
    for name, budget in (("sweep", 8), ("larger", 11)):
        text = COMPUTE.format(function=f"{FUNCTION}:picture", budget=budget)
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    for store, document in (("sweep", "sweep"), ("other", "larger")):
        common = ["sweep", str(folder / f"{document}.toml"), "--out", str(folder / store)]
        for step in (["--shell", "1"], ["--share", "1/1"], ["--collect"]):
            assert cli.main([*common, *step]) == 0
    with Store.open(folder / "other.cdb") as other:
        other.enter([{"a": 0.123, "b": 0.456}])
    with Store.open(folder / "sweep.cdb") as opened:
        keys = [row.key for row in opened.ledger.rows("done")]
        opened.ledger.set_manual("kind", {key: "good" if number < 4 else "bad" for number, key in enumerate(keys)})
        opened.write_table()
    channels = led_channels()
    write_spectra(folder / "lamps.csv", channels)
    write_spectra(folder / "others.csv", channels[:6])
    write_spectra(folder / "surfaces.csv", [reflectance(name) for name in ("red", "green", "blue", "yellow")])
    rng = np.random.default_rng(8)
    for name in ("lights.exr", "others.exr"):
        layers = 1e-4 * rng.uniform(0.1, 1.0, (3, BandStorage(31).channel_count, 4, 5)).astype(np.float32)
        lamps = (illuminant("D65"), illuminant("FL2"), illuminant("HP1"))
        transport = Transport(
            BandStorage(31), ("key", "fill", "sky"), layers, np.ones((4, 5), np.float32), lamps, 1.0, "0" * 64, 1, 0
        )
        write_transport(folder / name, transport)
    return folder, keys[2]


def outcome(
    words: Words, inputs: Path, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> tuple[int, str, dict[str, str]]:
    """Exit status, printed text without times, and a hash of each written file, of a command in a fresh folder."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(inputs, folder)
    monkeypatch.chdir(folder)
    capsys.readouterr()
    status = cli.main(words)
    printed = capsys.readouterr()
    assert not printed.err, words
    text = re.sub(r"[\d.]+ s\b|[\w-]*seconds\": [\d.]+", "", printed.out).replace(str(folder), "")
    files = {
        str(path.relative_to(folder)): hashlib.sha256(rounded(path.read_bytes())).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix not in {".sqlite", ".sqlite-wal", ".sqlite-shm", ".lock"}
    }
    return status, text, files


def rounded(content: bytes) -> bytes:
    """Numbers in texts without their last digits, which a product of matrices does not repeat on all processors."""
    return re.sub(rb"\d+\.\d{10,}(e-?\d+)?", lambda number: b"%.9g" % float(number[0]), content)


def options_of(command: str) -> set[str]:
    """Names of the options of a command."""
    parser = argparse.ArgumentParser()
    importlib.import_module(f"spectral_core.cli.{command}").add_arguments(parser)
    return {action.dest for action in parser._actions} - {"help", "json"}


def without_options(words: Words, given: Words) -> Words:
    """The words without the options of ``given`` and their values, as options with two values are refused."""
    kept, dropped = [], False
    for word in words:
        if word.startswith("--"):
            dropped = word in given
        if not dropped:
            kept.append(word)
    return kept


@pytest.mark.parametrize("command", CASES)
def test_each_option_has_an_effect(
    command: str, prepared: tuple[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    from spectral_core.explore.sweep import sweep

    base, cases = CASES[command]
    assert set(cases) | ELSEWHERE.get(command, set()) == options_of(command)
    inputs, key = prepared
    monkeypatch.setattr(serve, "PageServer", Server)
    monkeypatch.setattr(sweep.Sweep, "run", lambda self, plan, **options: Report(self, plan, **options))
    ignored, known = [], {}
    called = command.replace("_", "-")
    for name, (needed, given) in cases.items():
        without = [called, *base, *needed]
        with_it = [*without_options(without, given), *given] if given[0].startswith("--") else [called, *given]
        results = []
        for words in (without, with_it):
            words = [key if word == "KEY" else word for word in words]
            told = json.dumps(words)
            if told not in known:
                known[told] = outcome(words, inputs, tmp_path / "work", monkeypatch, capsys)
            results.append(known[told])
        if results[0] == results[1]:
            ignored.append(name)
    again = json.loads(told)
    assert outcome(again, inputs, tmp_path / "work", monkeypatch, capsys) == known[told]  # differs by nothing else
    assert not ignored
