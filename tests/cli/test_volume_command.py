# SPDX-License-Identifier: GPL-3.0-or-later
"""The command ``spectral-scene volume``: pictures, figures, frames and clear error messages."""

from __future__ import annotations

import json
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from blender_addon.commands import main
from spectral_core.spectra.pictures import png_bytes

EXAMPLES = Path(__file__).parents[2] / "examples" / "transfer"


@pytest.fixture(scope="module")
def blob(tmp_path_factory):
    """A smooth blob of 24³ voxels, off center."""
    folder = tmp_path_factory.mktemp("blob")
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, 24)] * 3, indexing="ij")
    values = np.exp(-4 * ((x - 0.2) ** 2 + (1.4 * y) ** 2 + z**2))
    np.save(folder / "blob.npy", values.astype(np.float32))
    np.save(folder / "t_0001.npy", values.astype(np.float32))
    np.save(folder / "t_0003.npy", (values**2).astype(np.float32))
    return folder


def call(capsys, *arguments):
    """Exit status and the JSON object of the last line."""
    status = main(["volume", *map(str, arguments), "--json"])
    return status, json.loads(capsys.readouterr().out.splitlines()[-1])


needs_drjit = pytest.mark.usefixtures("drjit_there")


@pytest.fixture
def drjit_there():
    pytest.importorskip("drjit")
    from spectral_core.render.variant import find_llvm

    if find_llvm() is None:
        pytest.skip("no LLVM 17 or newer here")


@needs_drjit
def test_the_measured_error_agrees_with_the_estimate(blob, capsys, tmp_path):
    arguments = ("--transfer", EXAMPLES / "wide.toml", "--size", 160, 120, "--target-snr", 45, "--report")
    status, figures = call(capsys, blob / "blob.npy", *arguments, "--out", tmp_path / "a.npy")
    assert status == 0
    assert (figures["shape"], figures["dtype"], figures["wanted_db"]) == ([24, 24, 24], "float32", 45)
    assert abs(figures["report"]["chosen"]["snr_db"] - figures["estimate_db"]) < 3
    assert figures["report"]["chosen"]["samples"] == figures["samples"] > 1000
    assert figures["report"]["reference_db"] > 60
    picture = np.load(tmp_path / "a.npy")
    assert picture.shape == (120, 160, 3)
    assert picture.max() > 0.2


@needs_drjit
def test_lights_share_one_march(blob, capsys, tmp_path):
    arguments = ("--transfer", EXAMPLES / "painted.toml", "--size", 64, 64, "--quality", "draft")
    lights = ("--light", "D65", "--light", "HP1", "--out", tmp_path / "b.npy")
    status, figures = call(capsys, blob / "blob.npy", *arguments, *lights)
    assert status == 0
    assert [Path(p).name for p in figures["pictures"]] == ["b_D65.npy", "b_HP1.npy"]
    day, street = (np.load(path) for path in figures["pictures"])
    # Under sodium light the blue shell has less blue relative to red.
    assert day[..., 2].sum() / day[..., 0].sum() > 4 * max(street[..., 2].sum() / street[..., 0].sum(), 0.01)


@needs_drjit
def test_a_pattern_renders_each_frame(blob, capsys, tmp_path):
    arguments = ("--transfer", EXAMPLES / "solid.toml", "--size", 32, 32, "--quality", "draft", "--rule", "uniform")
    status, figures = call(capsys, blob / "t_####.npy", *arguments, "--out", tmp_path / "t.png")
    assert status == 0
    assert [frame["frame"] for frame in figures["frames"]] == [1, 3]
    assert [Path(frame["pictures"][0]).name for frame in figures["frames"]] == ["t_0001.png", "t_0003.png"]
    assert all(frame["rule"] == "uniform" for frame in figures["frames"])
    assert (tmp_path / "t_0003.png").read_bytes().startswith(b"\x89PNG")


@needs_drjit
def test_marks_in_the_picture_name_are_the_frame_number(blob, capsys, tmp_path):
    """They stayed in the name, with a second number behind them: ``v_####_0001.png``."""
    arguments = ("--transfer", EXAMPLES / "solid.toml", "--size", 8, 8, "--quality", "draft", "--rule", "uniform")
    status, _ = call(capsys, blob / "t_####.npy", *arguments, "--out", tmp_path / "v##.b.png")
    assert status == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["v01.b.png", "v03.b.png"]


def test_a_picture_that_cannot_be_written_ends_the_command_before_the_march(tmp_path, capsys, monkeypatch):
    """The folder was found to be closed only after the picture was rendered."""
    from spectral_core.volume.renderer import VolumeRenderer

    monkeypatch.setattr(VolumeRenderer, "__init__", lambda *_: pytest.fail("the march was prepared"))
    (tmp_path / "file").write_text("")
    arguments = ["volume", "sample:gaussians:8", "--transfer", "wide", "--out", str(tmp_path / "file" / "a.png")]
    assert main(arguments) == 1
    assert "cannot be made" in capsys.readouterr().err


@needs_drjit
def test_a_sample_needs_no_file(capsys, tmp_path):
    arguments = ("--transfer", "opaque", "--size", 48, 48, "--quality", "draft", "--out", tmp_path / "s.npy")
    status, figures = call(capsys, "sample:gaussians:24", *arguments)
    assert status == 0
    assert figures["shape"] == [24, 24, 24]
    assert np.load(tmp_path / "s.npy").max() > 0.1


@needs_drjit
def test_raw_numbers_are_read_in_the_stated_layout(blob, capsys, tmp_path):
    values = (np.load(blob / "blob.npy") * 255).astype(">u2")
    (tmp_path / "a.bytes").write_bytes(values.tobytes(order="F"))
    layout = ("--raw-shape", 24, 24, 24, "--raw-type", "uint16", "--raw-order", "big", "--spacing", 1, 1, 2)
    rest = ("--transfer", EXAMPLES / "xray.toml", "--size", 32, 32, "--quality", "draft", "--fov", 0)
    status, figures = call(capsys, tmp_path / "a.bytes", *layout, *rest, "--out", tmp_path / "a.npy")
    assert status == 0
    assert figures["dtype"] == "uint16"
    assert np.load(tmp_path / "a.npy").max() > 0


def test_the_error_of_a_two_dimensional_function_is_measured(capsys, tmp_path):
    arguments = ("--transfer", "preset:edges", "--size", 64, 64, "--quality", "draft", "--report")
    status, figures = call(capsys, "sample:engine:32", *arguments, "--out", tmp_path / "a.png")
    assert status == 0 and figures["report"]["chosen"]["quadrature"] == "midpoint"
    assert abs(figures["report"]["chosen"]["snr_db"] - figures["estimate_db"]) < 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["missing.nrrd", "--transfer", "x.toml"], "there is no file missing.nrrd"),
        (["{blob}", "--transfer", "missing.toml"], "there is no file missing.toml"),
        (["{blob}", "--transfer", "{wide}", "--out", "a.gif"], "cannot tell the picture format of 'a.gif'"),
        (["{blob}", "--transfer", "{wide}", "--raw-type", "uint8"], "--raw-shape and --raw-type go together"),
        (["{blob}", "--transfer", "{wide}", "--field", "x"], "holds one array without a name"),
        (["{blob}", "--transfer", "{wide}", "--component", "2"], "it holds one number per voxel, leave component out"),
        (
            ["{blob}", "--transfer", "{wide}", "--raw-order", "big"],
            "--raw-order has no effect here: it needs --raw-shape",
        ),
        (["sample:engine", "--transfer", "{wide}", "--field", "x"], "--field has no effect here: a sample is not read"),
        (["sample:engine", "--transfer", "{wide}", "--azimuth", "inf"], "--azimuth is inf°; expected a value from"),
        (
            ["sample:engine", "--transfer", "{wide}", "--fov=-5"],
            "--fov (0 for orthographic) is -5.0°; expected a value",
        ),
        (["sample:engin", "--transfer", "{wide}"], "did you mean 'engine'"),
        (["sample:engine:1e3", "--transfer", "{wide}"], "expected sample:NAME or sample:NAME:SIZE"),
        (["sample:engine:²", "--transfer", "{wide}"], "expected sample:NAME or sample:NAME:SIZE"),
        (["{blob}", "--transfer", "wid"], "did you mean 'wide'"),
        (["{blob}", "--transfer", "{wide}", "--zoom", "0"], "zoom is 0.0; expected a value from"),
        (["{blob}", "--transfer", "{wide}", "--light", "D66"], "no illuminant is named 'D66'; did you mean 'D65'"),
        (["{blob}", "--transfer", "{palette}"], 'format is "spectral-scene palette"'),
        (["{blob}", "--transfer", "{wide}", "--rule", "fast"], "Known: auto, cells, error, thesis, uniform"),
        (["none_####.vti", "--transfer", "{wide}"], "no file in . matches"),
    ],
)
def test_errors_are_one_clear_line(blob, capsys, arguments, message):
    places = {"{blob}": str(blob / "blob.npy"), "{wide}": str(EXAMPLES / "wide.toml")}
    places["{palette}"] = str(EXAMPLES.parent / "split_light.toml")
    status = main(["volume", *[places.get(word, word) for word in arguments], "--json"])
    out, err = capsys.readouterr()
    assert status == 1
    assert message in err
    assert message in json.loads(out.splitlines()[-1])["error"]


def test_png_stores_the_pixels():
    pixels = np.random.default_rng(3).integers(0, 256, (5, 7, 3)).astype(np.uint8)
    data = png_bytes(pixels)
    width, height = struct.unpack(">II", data[16:24])
    start = data.index(b"IDAT")
    length = struct.unpack(">I", data[start - 4 : start])[0]
    rows = np.frombuffer(zlib.decompress(data[start + 4 : start + 4 + length]), np.uint8).reshape(height, 1 + 3 * width)
    assert (width, height) == (7, 5)
    assert np.array_equal(rows[:, 1:].reshape(5, 7, 3), pixels)


@needs_drjit
def test_two_volumes_whose_names_have_dots_get_two_pictures(blob, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("head.v1.npy", "head.v2.npy"):
        (tmp_path / name).write_bytes((blob / "blob.npy").read_bytes())
        status, figures = call(capsys, name, "--transfer", "wide", "--size", 8, 8, "--quality", "draft")
        assert status == 0 and figures["pictures"] == [name.replace(".npy", ".png")]
    empty = tmp_path / "empty.npy"
    np.save(empty, np.zeros((3, 3, 3), np.float32))
    status, figures = call(capsys, empty, "--transfer", "wide", "--size", 8, 8)
    assert status == 0 and figures["estimate_db"] is None and figures["interval_db"] == [None, None]


def test_a_file_whose_name_has_marks_of_a_pattern_is_a_file(blob, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    np.save(tmp_path / "head #2.npy", np.load(blob / "blob.npy"))
    (tmp_path / "wide").mkdir()  # a folder is no transfer function
    arguments = ["--transfer", "wide", "--size", "16", "16", "--quality", "draft", "--out", "p.npy"]
    assert main(["volume", "head #2.npy", *arguments]) == 0, capsys.readouterr().err
    assert (tmp_path / "p.npy").is_file()


def test_a_stated_spacing_keeps_place_and_directions():
    from spectral_core.cli.shared.volume_frames import spaced
    from spectral_core.volume.field import ScalarVolume

    turn = np.array([[0.0, -2, 0, 5], [-3, 0, 0, 6], [0, 0, 4, 7], [0, 0, 0, 1]])  # axes exchanged and mirrored
    made = spaced(ScalarVolume("v", np.zeros((2, 3, 4)), turn), [1.0, 10.0, 100.0])
    assert np.allclose(made.world_from_index, [[0, -10, 0, 5], [-1, 0, 0, 6], [0, 0, 100, 7], [0, 0, 0, 1]])


@needs_drjit
@pytest.mark.parametrize("transfer", ["wide", EXAMPLES / "solid.toml"])
def test_the_frames_of_a_sequence_share_one_function(tmp_path, capsys, transfer):
    """Each frame had a function of its own, fitted to its range: smoke that fades kept its density."""
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, 12)] * 3, indexing="ij")
    blob = np.exp(-4 * (x**2 + y**2 + z**2))
    for number, amount in enumerate((0.5, 1.0, 0.25)):
        np.save(tmp_path / f"fade_{number}.npy", amount * blob)
    arguments = ("--transfer", transfer, "--size", 16, 16, "--quality", "draft", "--rule", "uniform")
    status, _ = call(capsys, tmp_path / "fade_#.npy", *arguments, "--out", tmp_path / "o.npy")
    assert status == 0
    half, whole, quarter = (np.load(tmp_path / f"o_{number:04d}.npy").mean() for number in range(3))
    assert whole > 1.5 * half > 3 * quarter
    status, _ = call(capsys, tmp_path / "fade_1.npy", *arguments, "--out", tmp_path / "alone.npy")
    np.testing.assert_allclose(np.load(tmp_path / "alone.npy").mean(), whole, rtol=0.02)


@pytest.mark.parametrize("spacing", [("-1", "1", "1"), ("0", "1", "1"), ("nan", "1", "1"), ("1e300", "1", "1")])
def test_a_spacing_is_a_length(spacing: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    """A negative one showed the volume mirrored; NumPy warned of a huge one."""
    assert main(["volume", "sample:gaussians:8", "--transfer", "wide", "--spacing", *spacing]) == 1
    assert "expected a value from 1e-30 to 1e+30" in capsys.readouterr().err


@needs_drjit
def test_a_note_names_values_that_count_as_missing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    data = np.resize(np.linspace(0.0, 1.0, 500), (10, 10, 10)).astype(np.float32)
    data[0] = -9999.0
    np.save("marked.npy", data)
    np.save("labels.npy", np.resize([0, 1, 2, 255], (10, 10, 10)).astype(np.uint8))
    for name, is_noted in (("marked", True), ("labels", False)):
        assert main(["volume", f"{name}.npy", "--transfer", "wide", "--size", "16", "16"]) == 0
        assert ("-9999 counts as missing data" in capsys.readouterr().out) == is_noted


@needs_drjit
def test_the_frames_of_a_sequence_share_one_camera(tmp_path, capsys):
    """The camera was fitted to each frame: smoke that grew in its OpenVDB grid kept its size in the pictures."""
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files import write_volume

    for number, size in enumerate((4, 8, 16), 1):
        ball = ScalarVolume.from_spacing("ball", np.ones((size,) * 3, np.float32), (1, 1, 1), ((1 - size) / 2,) * 3)
        write_volume(ball, tmp_path / f"smoke_{number}.nrrd")
    arguments = ("--transfer", EXAMPLES / "solid.toml", "--size", 32, 32, "--quality", "draft", "--fov", 0)
    status, _ = call(capsys, tmp_path / "smoke_#.nrrd", *arguments, "--out", tmp_path / "o.npy")
    assert status == 0
    covered = [np.mean(np.load(tmp_path / f"o_{number:04d}.npy").max(axis=-1) > 0.05) for number in (1, 2, 3)]
    assert covered[1] > 3 * covered[0] and covered[2] > 3 * covered[1]
