# SPDX-License-Identifier: GPL-3.0-or-later
"""A command never writes over a file that it reads: a recording, the frames of a sequence, a file of spectra."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import Transport
from spectral_core.spectra import catalogue
from spectral_core.spectra.pictures import write_picture

LOST = "is read by this command and would be lost"


def refused(capsys: Any, kept: Path, *words: Any) -> None:
    before = kept.read_bytes()
    assert main([str(word) for word in words]) == 1
    assert LOST in capsys.readouterr().err
    assert kept.read_bytes() == before


def test_relight_keeps_the_recording(tmp_path: Path, capsys: Any) -> None:
    """``--out`` with the name of the recording replaced hours of rendering by a picture."""
    pytest.importorskip("OpenEXR")
    from spectral_core.render.relight.transport_file import write_transport

    path = tmp_path / "scene.exr"
    channels, coverage = np.ones((2, 3, 3, 4), np.float32), np.ones((3, 4), np.float32)
    lights = (catalogue.illuminant("D65"),) * 2
    write_transport(path, Transport(MixtureStorage(), ("a", "b"), channels, coverage, lights, 1.0, "hash", 1, 0))
    (tmp_path / "folder").mkdir()
    refused(capsys, path, "relight", path, "--out", path)
    refused(capsys, path, "relight", path, "--html", tmp_path / "folder" / ".." / "scene.exr")
    assert main(["relight", str(path), "--out", str(tmp_path / "other.exr")]) == 0


@pytest.mark.parametrize(
    ("given", "number", "expected"),
    [("x_####.png", 7, "x_0007.png"), ("x.exr", 7, "x_0007.exr"), ("a#b###.png", 12345, "a#b12345.png"),
     ("x.####.png", 3, "x.0003.png"), ("x_####.png", -2, "x_-0002.png"), ("x.png", -2, "x_-0002.png")],
)  # fmt: skip
def test_names_of_frames(given: str, number: int, expected: str) -> None:
    """``x_####.png`` of a dial's path became ``x_####_0007.png``; the sign of a frame was one of its digits."""
    from spectral_core.cli.relight import _pictures
    from spectral_core.cli.shared.outputs import numbered

    assert numbered(Path(given), number) == Path(expected)
    assert _pictures(Path("x_##.png"), 2) == [Path("x_01.png"), Path("x_02.png")]


def test_volume_keeps_every_frame(tmp_path: Path, capsys: Any) -> None:
    """The picture of a frame got the name of the frame itself."""
    for number in (1, 2):
        np.save(tmp_path / f"flow_{number:04d}.npy", np.zeros((2, 2, 2)))
    frame = tmp_path / "flow_0002.npy"
    refused(capsys, frame, "volume", tmp_path / "flow_####.npy", "--transfer", "wide", "--out", tmp_path / "flow.npy")
    refused(capsys, frame, "volume", frame, "--transfer", "wide", "--out", frame)


def test_design_keeps_the_spectra_of_a_palette(tmp_path: Path, capsys: Any) -> None:
    """``--out .`` beside the palette replaced the measured lights that it names by those of the solution."""
    lights, palette = tmp_path / "lights.csv", tmp_path / "two.toml"
    lights.write_text("nm,D65\n" + "".join(f"{nm},{nm - 300}\n" for nm in range(400, 701, 10)), "utf-8")
    text = (Path(__file__).parents[2] / "examples" / "split_light.toml").read_text("utf-8")
    old = next(line for line in text.splitlines() if line.startswith("spectrum = "))
    palette.write_text(text.replace(old, 'spectrum = {file = "lights.csv", name = "D65"}', 1), "utf-8")
    refused(capsys, lights, "design", palette, "--out", tmp_path)
    assert not (tmp_path / "solution.json").exists()


def test_mix_keeps_the_spectra(tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "paints.csv"
    path.write_text("nm,ochre,blue\n" + "".join(f"{nm},0.5,0.2\n" for nm in range(400, 701, 10)), "utf-8")
    refused(capsys, path, "mix", f"{path}@ochre:1", f"{path}@blue:2", "--out", path)
    assert main(["mix", f"{path}@ochre:1", f"{path}@blue:2", "--out", str(tmp_path / "mixed.csv")]) == 0


def recording(path: Path) -> Path:
    """A recording of two lights at ``path``."""
    pytest.importorskip("OpenEXR")
    from spectral_core.render.relight.transport_file import write_transport

    channels, coverage = np.ones((2, 3, 3, 4), np.float32), np.ones((3, 4), np.float32)
    lights = (catalogue.illuminant("D65"),) * 2
    write_transport(path, Transport(MixtureStorage(), ("a", "b"), channels, coverage, lights, 1.0, "hash", 1, 0))
    return path


def test_relight_along_a_path_keeps_the_recording(tmp_path: Path, capsys: Any) -> None:
    """The second picture of a path got the name of the recording."""
    path = recording(tmp_path / "dusk_0002.exr")
    refused(capsys, path, "relight", path, "--dial", "0,1;0,-1", "--frames", 3, "--out", tmp_path / "dusk.exr")
    assert not (tmp_path / "dusk_0001.exr").exists()
    assert main(["relight", str(path), "--dial", "0,1;0,-1", "--frames", "3", "--out", str(tmp_path / "d.exr")]) == 0
    assert sorted(each.name for each in tmp_path.glob("d_*")) == ["d_0001.exr", "d_0002.exr", "d_0003.exr"]


def test_a_path_has_as_many_frames_as_a_video(tmp_path: Path, capsys: Any) -> None:
    """A billion, as by a key that was held, named each file first: minutes without a word, then no memory."""
    path = recording(tmp_path / "dusk.exr")
    for frames in ("1", "1000000000"):
        common = ["relight", str(path), "--dial", "0,1;0,-1", "--out", str(tmp_path / "d.exr")]
        assert main([*common, "--frames", frames]) == 1
        assert f"--frames is {frames}; expected a value from 2 to 100000" in capsys.readouterr().err


def test_the_page_of_a_recording_ends_as_pages_do(tmp_path: Path, capsys: Any) -> None:
    """``--html`` wrote a page over any file, such as a text, under a name that no browser opens."""
    path, text = recording(tmp_path / "scene.exr"), tmp_path / "notes.txt"
    text.write_text("kept", "utf-8")
    assert main(["relight", str(path), "--html", str(text)]) == 1
    assert "end it with .html" in capsys.readouterr().err and text.read_text("utf-8") == "kept"
    assert main(["relight", str(path), "--html", str(tmp_path / "dial.HTML")]) == 0


def test_texture_keeps_what_it_reads(tmp_path: Path, capsys: Any) -> None:
    """``texture shown_1.png other.png --out .`` replaced its picture, and a document its file of lights."""
    pictures = [tmp_path / "shown_1.png", tmp_path / "other.png"]
    for number, path in enumerate(pictures):
        write_picture(path, np.full((4, 4, 3), 0.2 + 0.2 * number))
    lights, document = tmp_path / "lights.csv", tmp_path / "report.json"
    lights.write_text("nm,a,b\n" + "".join(f"{nm},{nm - 300},{800 - nm}\n" for nm in range(400, 701, 10)), "utf-8")
    refused(capsys, pictures[0], "texture", *pictures, "--out", tmp_path)
    named = [word for name in "ab" for word in ("--light", f"{lights}@{name}")]
    refused(capsys, lights, "texture", pictures[1], pictures[1], *named, "--out", tmp_path)
    document.write_text(json.dumps({
        "format": "spectral-scene texture", "version": 1, "pictures": ["other.png", "other.png"],
        "lights": [{"file": "lights.csv", "name": name} for name in "ab"],
    }), "utf-8")  # fmt: skip
    for command in ("texture", "design"):
        refused(capsys, document, command, document, "--out", tmp_path)
    document.rename(tmp_path / "two.json")
    refused(capsys, lights, "texture", tmp_path / "two.json", "--out", tmp_path)


@pytest.mark.parametrize(("words", "names", "ending"), [
    (["light-model", "--light", "D65"], ["m.csv", "m", "m.json.gz"], ".json"),
    (["lattice", "--points", "3"], ["p.json", "p.png", "p"], ".csv"),
])  # fmt: skip
def test_a_name_that_announces_other_contents_is_refused(
    tmp_path: Path, capsys: Any, words: list[str], names: list[str], ending: str
) -> None:
    """``light-model --out m.csv`` wrote JSON into a file that spreadsheets open."""
    for name in names:
        assert main([*words, "--out", str(tmp_path / "new" / name)]) == 1
        assert f"so end it with {ending}" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()
