# SPDX-License-Identifier: GPL-3.0-or-later
"""A texture as a document and as a command: `texture` and `design` give the same result."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("mitsuba")
pytest.importorskip("OpenEXR")

from spectral_core import cli
from spectral_core.documents import write_document
from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.palette.texture import pinned
from spectral_core.palette.texture.basis import design_basis
from spectral_core.palette.texture.file import read_texture
from spectral_core.palette.texture.project import TextureProject, TextureSettings, document_of, read_project
from spectral_core.palette.texture.realism import DAYLIGHT_SHARES, LED_WIDTHS_NM, realism_cost, white_differences
from spectral_core.palette.texture.uplift import Pin
from spectral_core.render.images.pictures import read_picture
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, linear_from_display_rgb
from spectral_core.spectra.pictures import png_bytes, write_png_rows


@pytest.fixture
def pictures(tmp_path):
    paths = []
    for seed in (1, 2):
        pixels = np.random.default_rng(seed).integers(40, 220, (9, 11, 3), dtype=np.uint8)
        paths.append(tmp_path / f"picture{seed}.png")
        paths[-1].write_bytes(png_bytes(pixels))
    return paths


def test_a_document_keeps_the_whole_project(tmp_path, pictures) -> None:
    project = TextureProject(
        (pictures[0],), (illuminant("D65"), illuminant("HP1")),
        (Pin([0.5, 0.1, 0.1], [0.3, 0.2, 0.1]),), TextureSettings(spectra=8, floor=0.01),
    )  # fmt: skip
    write_document(tmp_path / "t.toml", document_of(project))
    again = read_project(tmp_path / "t.toml")
    assert again.pictures == project.pictures
    assert again.settings == project.settings or vars_of(again.settings) == vars_of(project.settings)
    np.testing.assert_array_equal(again.lights[1].values, project.lights[1].values)
    np.testing.assert_array_equal(again.wanted_colors[0].wanted, project.wanted_colors[0].wanted)


def vars_of(settings: TextureSettings) -> dict:
    return {name: getattr(settings, name) for name in TextureSettings.__dataclass_fields__}


@pytest.fixture
def few_iterations(monkeypatch):
    """Short searches: how good the spectra are does not matter here."""
    monkeypatch.setattr(pinned, "RESTARTS", 1)
    monkeypatch.setattr(pinned, "TRIALS", 80)
    monkeypatch.setitem(design_basis.__kwdefaults__, "iterations", 3)


@pytest.mark.usefixtures("few_iterations")
def test_design_and_texture_give_equal_results_for_a_document_with_a_wanted_color(tmp_path, pictures, capsys) -> None:
    text = (
        'format = "spectral-scene texture"\nversion = 1\npictures = ["picture1.png"]\nlights = ["D65", "A"]\n'
        '[[wishes]]\ncolor = "#905050"\nwanted = "#a06040"\n'
    )
    (tmp_path / "one.toml").write_text(text)
    for command, out in (("design", "d"), ("texture", "t")):
        assert cli.main([command, str(tmp_path / "one.toml"), "--out", str(tmp_path / out)]) == 0
    assert "wanted color 1" in capsys.readouterr().out
    textures = [read_texture(tmp_path / out / "texture.exr") for out in "dt"]
    np.testing.assert_allclose(textures[0].weights, textures[1].weights, atol=1e-3)  # of half precision
    shown = textures[0].picture(illuminant("D65"))
    wanted = linear_from_display_rgb(read_picture(pictures[0]) / 255)
    assert delta_e_2000(lab_from_linear_rgb(shown), lab_from_linear_rgb(wanted)).max() < 0.3
    report = json.loads((tmp_path / "d" / "report.json").read_text())
    assert report["wanted_colors"][0]["delta_e"] < 5
    assert {each["observer"] for each in report["whites"]} >= {"cie_1964_10deg", "cie_2015_10deg"}


@pytest.mark.usefixtures("few_iterations")
def test_the_command_prints_its_progress(tmp_path, pictures, capsys) -> None:
    words = ["texture", *map(str, pictures), "--light", "D65", "--light", "HP1", "--exact", "--progress"]
    assert cli.main([*words, "--out", str(tmp_path / "o")]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines() if line.startswith("progress")]
    shares = [float(line[1]) for line in lines]
    assert shares == sorted(shares)
    assert shares[0] == 0
    assert shares[-1] == 1


def test_invalid_projects_are_refused(tmp_path, pictures) -> None:
    with pytest.raises(InvalidInputError, match="one picture needs two lights"):
        TextureProject((pictures[0],))
    with pytest.raises(InvalidInputError, match="wanted colors are for one picture"):
        TextureProject(tuple(pictures), wanted_colors=(Pin([0, 0, 0], [0, 0, 0]),))
    (tmp_path / "bad.toml").write_text('format = "spectral-scene texture"\nversion = 1\npictures = []\n')
    with pytest.raises(FileFormatError, match="pictures has 0 entries"):
        read_project(tmp_path / "bad.toml")


def test_a_picture_written_in_strips_equals_one_written_at_once(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("spectral_core.spectra.pictures.BAND_PIXELS", 40)
    linear = np.random.default_rng(0).random((23, 17, 3))
    write_png_rows(tmp_path / "p.png", (23, 17), lambda first, last: linear[first:last])
    found = linear_from_display_rgb(read_picture(tmp_path / "p.png") / 255)
    np.testing.assert_allclose(found, linear, atol=0.006)


def test_costs_of_realism_and_whites_of_other_observers() -> None:
    assert realism_cost(0, 20).contrast > realism_cost(0.15, 20).contrast > realism_cost(0.4, 20).contrast > 1
    # At an entry of the table the slider states the measured value in the same unit.
    assert realism_cost(0, 20).contrast == pytest.approx(19.89)
    assert realism_cost(0, 10).contrast > realism_cost(0, 45).contrast
    # Daylight in both lights and wide LEDs can only reduce contrast; a design is a local optimum, so by a little less.
    table = np.array([[realism_cost(share, width).contrast for share in DAYLIGHT_SHARES] for width in LED_WIDTHS_NM])
    assert np.all(np.diff(table, axis=0) <= 0.1 + 1e-9) and np.all(np.diff(table, axis=1) < 0.0)
    plain = white_differences([illuminant("D65")])
    assert max(each.to_daylight for each in plain) < 1e-6
    assert white_differences([illuminant("D65"), illuminant("FL11")])[1].between > 1


@pytest.mark.parametrize(
    ("name", "inside", "outside"),
    [("daylight_share", (0.0, 0.9), (-0.01, 0.91)), ("led_width_nm", (5.0, 60.0), (4.9, 60.1)),
     ("importance", (1e-3, 1e3), (0.9e-3, 1.1e3))],
)  # fmt: skip
def test_settings_have_limits(name: str, inside: tuple[float, float], outside: tuple[float, float]) -> None:
    for value in inside:
        assert getattr(TextureSettings(**{name: value}), name) == value
    for value in outside:
        with pytest.raises(InvalidInputError, match=name):
            TextureSettings(**{name: value})


def test_reading_a_picture_keeps_the_variant_of_the_caller(pictures) -> None:
    """It left Mitsuba's variant ``scalar_rgb`` to a program that renders with Mitsuba itself."""
    import mitsuba

    mitsuba.set_variant("llvm_ad_spectral")
    assert read_picture(pictures[0]).shape == (9, 11, 3)
    assert mitsuba.variant() == "llvm_ad_spectral"
