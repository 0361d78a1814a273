# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra that a command line names: files beside the catalogue, equal names, and messages."""

from __future__ import annotations

import json
import unicodedata
from pathlib import Path

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.cli.shared.spectra import illuminant_named, reflectance_named
from spectral_core.files.names import file_words
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.transport import Transport
from spectral_core.render.relight.transport_file import write_transport
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.files import write_spectra
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, told_apart


def tables(folder: Path) -> list[str]:
    """Two files that name their spectrum alike, in a folder with a mark in its name."""
    made = folder / "me@work"
    made.mkdir()
    words = []
    for number, values in enumerate(([0.1, 0.4, 0.9], [0.8, 0.3, 0.2]), 1):
        path = made / f"{number}.csv"
        path.write_text("nm,x\n" + "".join(f"{nm},{v}\n" for nm, v in zip((400, 550, 700), values, strict=True)))
        words.append(str(path))
    return words


@pytest.mark.parametrize("name", ["D65", "sodium", "blackbody 3200"])
def test_catalogue_names_mean_the_catalogue_beside_a_file_of_that_name(name: str, tmp_path: Path, monkeypatch) -> None:
    """The file's spectrum was used without a word."""
    monkeypatch.chdir(tmp_path)
    for file in (name, "red"):
        Path(file).write_text("nm,x\n400,1\n700,1\n")
    assert np.array_equal(illuminant_named(name).values, illuminant(name).values)
    assert np.array_equal(reflectance_named("red").values, reflectance("red").values)
    for word in (f"./{name}", str(tmp_path / name), f"{name}@x"):
        assert illuminant_named(word).values.tolist() == [1.0, 1.0]
    assert reflectance_named("./red").values.tolist() == [1.0, 1.0]


def test_preset_names_mean_the_preset_beside_a_file_of_that_name(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("xray").write_text("not a transfer function")
    words = ["volume", "sample:shells", "--size", "16", "16", "--quality", "draft", "--out", "a.png"]
    assert main([*words, "--transfer", "xray"]) == 0, capsys.readouterr().err
    assert main([*words, "--transfer", "./xray"]) != 0


def test_lights_and_surfaces_of_one_name_are_all_written(tmp_path: Path, capsys) -> None:
    first, second = tables(tmp_path)
    out = tmp_path / "model.json"
    named = ["--light", first, "--light", f"{second}@x", "--surface", first, "--surface", second]
    assert main(["light-model", *named, "--out", str(out)]) == 0
    assert "under x 1, x 2" in capsys.readouterr().out
    model = json.loads(out.read_text("utf-8"))
    assert list(model["surfaces"]) == list(model["linear_rgb_from_coefficients"]) == ["x 1", "x 2"]
    assert model["surfaces"]["x 1"] != model["surfaces"]["x 2"]


def test_names_that_numbers_would_make_equal_stay_apart() -> None:
    grid = SpectralGrid.uniform(400, 700, 100)
    named = [Reflectance(name, grid, np.full(4, 0.5)) for name in ("x", "x", "x 1", "y")]
    names = [each.name for each in told_apart(named)]
    assert len(set(names)) == 4
    assert names[2:] == ["x 1", "y"]


def test_recipes_keep_the_error_under_each_light(tmp_path: Path, capsys) -> None:
    first, second = tables(tmp_path)
    write_spectra(tmp_path / "paints.csv", [reflectance(name) for name in ("red", "yellow", "white 9.5 (.05 D)")])
    words = ["recipe", "paints", str(tmp_path / "paints.csv"), "--target", "orange"]
    assert main([*words, "--light", first, "--light", second, "--json"]) == 0
    assert list(json.loads(capsys.readouterr().out.splitlines()[-1])["delta_e"]) == ["x 1", "x 2"]


def test_a_recipe_does_not_depend_on_the_order_of_paints_that_were_measured_over_different_ranges(
    tmp_path: Path, capsys
) -> None:
    """Beyond the range of its own measurement a paint counted as black."""

    def measured(name: str, low: float, high: float) -> Reflectance:
        grid = SpectralGrid.uniform(low, high, 10)
        return Reflectance(name, grid, reflectance(name).at(grid.wavelengths_nm))

    paints = [measured("red", 380, 730), measured("yellow", 430, 660), measured("white 9.5 (.05 D)", 440, 700)]
    found = []
    for number, listed in enumerate((paints, paints[::-1])):
        write_spectra(tmp_path / f"{number}.csv", listed)
        assert main(["recipe", "paints", str(tmp_path / f"{number}.csv"), "--target", "orange", "--json"]) == 0
        out = capsys.readouterr().out.splitlines()
        assert out[0].startswith("note: the recipe has 440 to 660 nm, the range that all spectra have ('")
        found.append(json.loads(out[-1]))
    assert found[0]["amounts"] == pytest.approx(found[1]["amounts"], abs=1e-4)
    assert found[0]["delta_e"] == pytest.approx(found[1]["delta_e"], abs=1e-3)


def test_a_mixture_keeps_the_wavelengths_of_its_parts_and_takes_lights_of_files(tmp_path: Path, capsys) -> None:
    nm = np.array([380, 500, 500.5, 501, 740, 741, 742, 780])
    spike = Reflectance("spike", SpectralGrid(nm), np.array([0, 0, 1, 0, 0, 1, 0, 0.0]))
    lamp = Illuminant("of a file", SpectralGrid(np.array([380, 780.0])), np.ones(2))
    write_spectra(tmp_path / "paint.csv", [spike])
    write_spectra(tmp_path / "lamp.csv", [lamp])
    words = ["mix", f"{tmp_path / 'paint.csv'}:1", "--law", "additive", "--light", str(tmp_path / "lamp.csv"), "--json"]
    assert main(words) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert figures["wavelengths_nm"] == nm.tolist()
    assert figures["reflectance"] == spike.values.tolist()
    assert list(figures["colors"]) == ["of a file"]
    assert figures["colors"]["of a file"] != "#000000"


def test_a_mixture_is_known_where_all_its_parts_are(tmp_path: Path, capsys) -> None:
    first, _ = tables(tmp_path)
    assert main(["mix", f"{first}:1", "red:1", "--json"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert "the mixture has 400 to 700 nm" in out[0]
    assert json.loads(out[-1])["wavelengths_nm"][0] == 400
    write_spectra(tmp_path / "far.csv", [Reflectance("far", SpectralGrid.uniform(800, 900, 50), np.full(3, 0.5))])
    assert main(["mix", f"{tmp_path / 'far.csv'}:1", "red:1"]) == 1
    assert "no wavelength is in all spectra" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("{folder}/none.csv", "there is no file {folder}/none.csv"),
        ("{folder}/none.csv@x", "there is no file {folder}/none.csv;"),
        ("{folder}/1.csv@z", "named 'z'; known: x"),
        ("{folder}/twice.csv", "holds 2 spectra ('x', 'x'), expected one"),
        ("{folder}/many.csv", "holds 11 spectra ('l0', 'l1', 'l2', 'l3', 'l4', 'l5', 'l6', 'l7' and 3 more), expected"),
        ("{folder}/twice.csv@x", "2 spectra that are named 'x'; rename them"),
        ("daylihgt", "no illuminant is named 'daylihgt'"),
    ],
)
def test_a_word_that_names_no_spectrum_is_explained(tmp_path: Path, capsys, word: str, message: str) -> None:
    folder = Path(tables(tmp_path)[0]).parent
    (folder / "twice.csv").write_text("nm,x,x\n400,1,2\n500,1,2\n")
    columns = [f"l{number}" for number in range(11)]
    (folder / "many.csv").write_text("\n".join([",".join(["nm", *columns]), "400" + ",1" * 11, "500" + ",2" * 11]))
    assert main(["light-model", "--light", word.format(folder=folder)]) == 1
    assert message.format(folder=folder) in capsys.readouterr().err


def test_pictures_under_lights_with_any_name_get_a_file_each(tmp_path: Path, monkeypatch, capsys) -> None:
    """A slash in a catalogue name ended the command in a traceback after the render."""
    from spectral_core.cli import volume
    from spectral_core.spectra import pictures
    from spectral_core.volume.mitsuba_integrator import illumination

    monkeypatch.setattr(illumination, "display_matrix", lambda transfer, light: np.eye(3))
    monkeypatch.setattr(pictures, "write_picture", lambda path, pixels: Path(path).write_bytes(b"picture"))

    class Image:
        amounts = np.zeros((1, 1, 3), np.float32)
        transfer = None

    lights = [illuminant("3-LED-1 (457/540/605)"), illuminant("3-LED-2 Yellow"), illuminant("D65")]
    written = volume._write_lights(lights, Image(), tmp_path / "engine.png")
    assert len(set(written)) == 3
    assert all(Path(each).parent == tmp_path and Path(each).is_file() for each in written)
    assert file_words(["a/b", "A_b", "", "c.d"]) == ["a_b", "A_b_2", "_", "c_d"]


def test_long_names_and_two_forms_of_a_letter_get_a_file_each(tmp_path) -> None:
    """A name of 250 letters was no file name, and 가 in two forms is one file where the system composes letters."""
    names = ["漢" * 200, "漢" * 201, "n" * 250, "\uac00", "\u1100\u1161"]
    words = file_words(names)
    for word in words:
        (tmp_path / f"stem_{word}.spdx").write_text("")
    assert len({unicodedata.normalize("NFC", word) for word in words}) == len(names)


def test_relight_takes_one_spectrum_of_a_file(tmp_path: Path) -> None:
    path, file = tmp_path / "lamps.csv", tmp_path / "lights.exr"
    path.write_text("nm,warm,cold\n400,0.1,1\n550,0.5,0.6\n700,1,0.2\n", encoding="utf-8")
    storage, lamps = BandStorage(31), (illuminant("D65"),)
    layers = np.full((1, storage.channel_count, 2, 3), 1e-4, np.float32)
    coverage = np.ones((2, 3), np.float32)
    write_transport(file, Transport(storage, ("key",), layers, coverage, lamps, 1.0, "0" * 64, 1, 0))
    red_over_blue = []
    for name in ("warm", "cold"):
        out = tmp_path / f"{name}.npy"
        assert main(["relight", str(file), "--light", f"key={path}@{name}", "--out", str(out)]) == 0
        red_over_blue.append(np.load(out)[0, 0, 0] / np.load(out)[0, 0, 2])
    assert red_over_blue[0] > 2 * red_over_blue[1]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--mix", "key=1, key=0"], "--mix names the light group 'key' twice"),
        (["--light", "key=A,key=HP1"], "--light names the light group 'key' twice"),
        (["--mix", "key=nan"], "--mix has 'nan'; expected a number such as 0.3"),
        (["--dial", "inf,0"], "--dial has 'inf'; expected a number"),
    ],
)
def test_relight_refuses_what_it_would_ignore_or_could_not_show(tmp_path: Path, capsys, words, message) -> None:
    storage, file = BandStorage(31), tmp_path / "lights.exr"
    layers = np.full((1, storage.channel_count, 2, 3), 1e-4, np.float32)
    coverage = np.ones((2, 3), np.float32)
    write_transport(file, Transport(storage, ("key",), layers, coverage, (illuminant("D65"),), 1.0, "0" * 64, 1, 0))
    assert main(["relight", str(file), *words, "--out", str(tmp_path / "x.png")]) == 1
    assert message in capsys.readouterr().err
    assert not (tmp_path / "x.png").exists()


def test_a_texture_takes_lights_as_the_other_commands_do(tmp_path: Path, capsys) -> None:
    """Of the file of lights that the command itself writes, neither light could be given again."""
    import argparse

    from spectral_core.cli import texture

    parser = argparse.ArgumentParser()
    texture.add_arguments(parser)
    write_spectra(tmp_path / "lights.csv", [illuminant("D65"), illuminant("HP1")])
    words = ["one.png", "two.png", "--light", f"{tmp_path / 'lights.csv'}@HP1", "--light", "blackbody 3200.5"]
    first, second = texture._project(parser.parse_args(words)).lights
    assert (first.name, second.name) == ("HP1", "blackbody 3200.5")
    np.testing.assert_array_equal(first.values, illuminant("HP1").values)
    named = [each.name for each in texture._project(parser.parse_args([*words[:4], *words[2:4]])).lights]
    assert len(set(named)) == 2
    assert main(["texture", "one.png", "--light", "D65"]) == 1
    assert "got 1 with --light; a texture needs two lights, or none for two pictures" in capsys.readouterr().err
