# SPDX-License-Identifier: GPL-3.0-or-later
"""Every command makes the folders of its outputs; a name that it refuses makes none."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import Transport
from spectral_core.spectra import catalogue
from spectral_core.spectra.pictures import write_picture

TABLE = "a,b\n1,2\n2,3\n3,5\n4,1\n"
COMMANDS = {
    "design": (["design", "--preset", "Hidden mark", "--rounds", "1", "--out"], "made/new", "made/new/lights.csv"),
    "mix": (["mix", "cyan:3", "blue:1", "--out"], "made/new/mixed.csv", None),
    "light-model": (["light-model", "--light", "D65", "--surface", "dark skin", "--out"], "made/new/model.json", None),
    "lattice": (["lattice", "--points", "4", "--out"], "made/new/points.csv", None),
    "relight": (["relight", "two.exr", "--out"], "made/new/night.png", None),
    "relight page": (["relight", "two.exr", "--html"], "made/new/client.html", None),
    "explore": (["explore", "table.cdb", "--out"], "made/new/page.html", None),
    "figure": (["explore", "table.cdb", "--columns", "a", "b", "--figure"], "made/new/matrix.png", None),
    "error-time": (
        ["explore", "table.cdb", "--columns", "a", "--time", "b", "--error-time"], "made/new/pareto.svg", None
    ),
}  # fmt: skip
REFUSED = {
    "mix": (["mix", "cyan:3", "--out"], "made/mixed.xyz", "cannot tell the format"),
    "relight": (["relight", "two.exr", "--out"], "made/night.gif", "cannot tell the picture format"),
    "relight page": (["relight", "two.exr", "--html"], "made/client.txt", "end it with .html"),
    "lights": (["relight", "two.exr", "--light", "Key=nope", "--out"], "made/night.png", "nope"),
    "figure": (["explore", "table.cdb", "--figure"], "made/matrix.gif", "a figure ends in"),
    "no sweep": (["explore", "nowhere", "--figure"], "made/matrix.png", "nowhere"),
    "texture": (["texture", "a.png", "small.png", "--out"], "made", "differ in size"),
    "texture range": (["texture", "a.png", "a.png", "--floor", "0.7", "--out"], "made", "expected a value from 0.0"),
    "texture count": (["texture", "a.png", "a.png", "--spectra", "0", "--out"], "made", "--spectra is 0"),
    "lattice": (["lattice", "--low", "1", "--high", "0", "--out"], "made/points.csv", "--low"),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with the files that the commands read."""
    pytest.importorskip("OpenEXR")
    from spectral_core.render.relight.transport_file import write_transport

    monkeypatch.chdir(tmp_path)
    write_picture(Path("a.png"), np.full((4, 4, 3), 0.3, np.float32))
    write_picture(Path("small.png"), np.full((2, 3, 3), 0.3, np.float32))
    channels, coverage = np.ones((2, 3, 3, 4), np.float32), np.ones((3, 4), np.float32)
    lights = (catalogue.illuminant("D65"),) * 2
    write_transport("two.exr", Transport(MixtureStorage(), ("Key", "Fill"), channels, coverage, lights, 1.0, "h", 1, 0))
    (tmp_path / "table.cdb").mkdir()
    (tmp_path / "table.cdb/data.csv").write_text(TABLE, "utf-8")
    return tmp_path


@pytest.mark.parametrize("name", COMMANDS)
def test_missing_folders_are_made(folder: Path, name: str, capsys: Any) -> None:
    """Four commands made them, five others said "create it first" after the work."""
    if name in ("figure", "error-time"):
        pytest.importorskip("matplotlib")
    words, target, written = COMMANDS[name]
    assert main([*words, target]) == 0, capsys.readouterr().err
    assert (folder / (written or target)).is_file()


@pytest.mark.parametrize("name", REFUSED)
def test_a_refused_call_leaves_no_folder(folder: Path, name: str, capsys: Any) -> None:
    words, target, message = REFUSED[name]
    before = sorted(folder.rglob("*"))
    assert main([*words, target]) == 1
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert sorted(folder.rglob("*")) == before


def test_a_folder_that_cannot_be_made_is_named_before_the_work(folder: Path, capsys: Any) -> None:
    for words, target, _ in COMMANDS.values():
        shutil.rmtree("made", ignore_errors=True)
        Path("made").unlink(missing_ok=True)
        Path("made").write_text("a file", "utf-8")
        assert main([*words, target]) == 1
        assert "made is a file; choose another folder" in capsys.readouterr().err


def test_a_light_model_keeps_the_spectra_that_it_reads(folder: Path, capsys: Any) -> None:
    """``--out`` with the name of the file of a surface replaced the measurements."""
    path = folder / "paints.csv"
    path.write_text("nm,ochre,blue\n" + "".join(f"{nm},0.5,0.2\n" for nm in range(400, 701, 10)), "utf-8")
    before = path.read_bytes()
    assert main(["light-model", "--surface", "paints.csv@ochre", "--out", "paints.csv"]) == 1
    assert "would be lost" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_the_home_folder_in_an_option(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    """``--out=~/pictures``, which shells leave as it is, made a folder named ~."""
    monkeypatch.setenv("HOME", str(folder / "home"))
    assert main(["mix", "cyan:3", "--out=~/new/mixed.csv"]) == 0
    assert main(["mix", "cyan:3", "--out", "./~odd.csv"]) == 0
    assert (folder / "home/new/mixed.csv").is_file() and (folder / "~odd.csv").is_file()
    assert not (folder / "~").exists()
    kept = folder / "home/new/mixed.csv"
    assert main(["light-model", "--light", "D65", "--surface=~/new/mixed.csv", "--out", str(kept)]) == 1
    assert "would be lost" in capsys.readouterr().err
