# SPDX-License-Identifier: GPL-3.0-or-later
"""Swatches: ASE with the bytes of Adobe's programs, GPL with the text of GIMP."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.palette import solve_palette
from spectral_core.palette.files import Swatch, read_swatches, swatches_of, write_swatches
from spectral_core.palette.presets import metamer_pair
from spectral_core.spectra.color import display_hex_from_linear, display_rgb_from_linear, linear_from_display_rgb

SWATCHES = [
    Swatch("rød Ω", np.array([1.0, 0.0, 0.25]), "daylight"),
    Swatch("gray", np.array([0.5, 0.5, 0.5]), "daylight"),
    Swatch("loose", np.array([0.0, 1.0, 0.0])),
    Swatch("", np.array([0.0, 0.0, 0.0]), "sodium"),
]


def test_ase_keeps_names_groups_and_colors(tmp_path: Path) -> None:
    assert write_swatches(tmp_path / "s.ase", SWATCHES) == ()
    read = read_swatches(tmp_path / "s.ase")
    assert [(s.name, s.group) for s in read] == [(s.name, s.group) for s in SWATCHES]
    for one, other in zip(read, SWATCHES, strict=True):
        np.testing.assert_allclose(one.linear_rgb, other.linear_rgb, atol=1e-7)  # in single precision


def test_ase_bytes_equal_those_of_adobe(tmp_path: Path) -> None:
    write_swatches(tmp_path / "one.ase", [Swatch("Ab", np.array([1.0, 0.0, 0.0]))])
    color = b"RGB " + struct.pack(">3f", 1, 0, 0) + b"\x00\x02"
    name = b"\x00\x03\x00A\x00b\x00\x00"
    block = b"\x00\x01" + struct.pack(">I", len(name + color)) + name + color
    assert (tmp_path / "one.ase").read_bytes() == b"ASEF\x00\x01\x00\x00\x00\x00\x00\x01" + block


def test_gpl_files_of_gimp_are_read(tmp_path: Path) -> None:
    write_swatches(tmp_path / "s.gpl", SWATCHES)
    text = (tmp_path / "s.gpl").read_text("utf-8")
    assert text.splitlines()[:2] == ["GIMP Palette", "Name: s"]
    assert "255   0 137\tdaylight / rød Ω" in text
    read = read_swatches(tmp_path / "s.gpl")
    assert [(s.name, s.group) for s in read][:3] == [(s.name, s.group) for s in SWATCHES][:3]
    for one, other in zip(read, SWATCHES, strict=True):
        display = display_rgb_from_linear(one.linear_rgb)
        np.testing.assert_allclose(display, display_rgb_from_linear(other.linear_rgb), atol=0.5 / 255)
    old = "GIMP Palette\n#\n  1   2   3 Ungrouped name\n10 20 30\n"
    (tmp_path / "old.gpl").write_text(old, encoding="utf-8")
    assert [s.name for s in read_swatches(tmp_path / "old.gpl")] == ["Ungrouped name", "Untitled"]


@pytest.mark.parametrize("group", ["", "D65", "day / night", "D65 /"])
@pytest.mark.parametrize("name", ["a / b", "/ b", "a /", "red", "D65 / red", "255 gray"])
def test_gpl_keeps_names_and_groups_with_slashes(tmp_path: Path, name: str, group: str) -> None:
    written = [Swatch(name, np.full(3, 0.5), group), Swatch("next", np.full(3, 0.5), "D50"), Swatch(name, np.ones(3))]
    write_swatches(tmp_path / "s.gpl", written)
    found = read_swatches(tmp_path / "s.gpl")
    assert [(each.name, each.group) for each in found] == [(each.name, each.group) for each in written]


def test_gpl_files_of_aseprite_are_read(tmp_path: Path) -> None:
    path = tmp_path / "pico.gpl"
    path.write_text("GIMP Palette\nChannels: RGBA\n#\n  0   0   0 255 Untitled\n 29  43  83 255\tdark blue\n")
    found = read_swatches(path)
    assert [each.name for each in found] == ["Untitled", "dark blue"]
    np.testing.assert_allclose(255 * display_rgb_from_linear(found[1].linear_rgb), [29, 43, 83])
    path.write_text("GIMP Palette\nChannels: RGBA\n#\n  0   0   0   0 Transparent\n")
    with pytest.raises(FileFormatError, match=r"line 4: 'Transparent' has the opacity 0; expected 255"):
        read_swatches(path)
    path.write_text("GIMP Palette\nChannels: RGBA\n#\n  0   0   0 black\n")
    with pytest.raises(FileFormatError, match="expected four numbers to 255 and a name"):
        read_swatches(path)
    path.write_text("GIMP Palette\nChannels: CMYK\n#\n  0   0   0 black\n")
    with pytest.raises(FileFormatError, match="line 2: the channels are 'CMYK'; expected RGB or RGBA"):
        read_swatches(path)


def test_a_gpl_file_whose_name_is_no_text_is_written(tmp_path: Path) -> None:
    path = tmp_path / "s\udcff\n.gpl"
    write_swatches(path, [SWATCHES[0]])
    assert [each.name for each in read_swatches(path)] == ["rød Ω"]
    with pytest.raises(InvalidInputError, match="the name of a swatch is .* which no file can store"):
        Swatch("\udcff", np.zeros(3))


def test_every_cell_of_a_solution_is_a_swatch(tmp_path: Path) -> None:
    solution = solve_palette(metamer_pair())
    swatches = swatches_of(solution)
    assert [(s.group, s.name) for s in swatches] == [
        (light, row) for light in ("HP1", "D65") for row in ("reflectance 1", "reflectance 2")
    ]
    np.testing.assert_array_equal(swatches[1].linear_rgb, solution.actual_linear_rgb[1, 0])


def test_colors_outside_the_gamut_are_reported(tmp_path: Path) -> None:
    sodium = Swatch("sign", np.array([1.2, 0.5, -0.1]), "sodium")
    with pytest.raises(
        InvalidInputError, match=r"1 of 2 colors are outside .* such as 'sodium / sign'; pass clip=True"
    ):
        write_swatches(tmp_path / "s.gpl", [SWATCHES[0], sodium])
    assert not (tmp_path / "s.gpl").exists()
    assert write_swatches(tmp_path / "s.gpl", [SWATCHES[0], sodium], clip=True) == ("sodium / sign",)
    nearest = linear_from_display_rgb(np.round(255 * display_rgb_from_linear([1, 0.5, 0])) / 255)
    np.testing.assert_allclose(read_swatches(tmp_path / "s.gpl")[1].linear_rgb, nearest)


@pytest.mark.parametrize(
    "color", [(1.2, 0.5, -0.1), (0.19, -0.24, 2.5), (4.0, 0.2, 0.2)], ids=["sodium", "blue", "red"]
)
def test_a_color_outside_the_gamut_is_written_as_the_table_shows_it(tmp_path: Path, color: tuple[float, ...]) -> None:
    """The message spoke of the nearest color: that of the blue, by CIEDE2000, has less than half of this red."""
    with pytest.raises(InvalidInputError, match="cut their channels at 0 and 1, as screens show them"):
        write_swatches(tmp_path / "one.gpl", [Swatch("one", np.array(color))])
    write_swatches(tmp_path / "one.gpl", [Swatch("one", np.array(color))], clip=True)
    written = [int(word) for word in (tmp_path / "one.gpl").read_text().splitlines()[-1].split()[:3]]
    assert "#" + bytes(written).hex() == display_hex_from_linear(np.array(color))


@pytest.mark.parametrize("channel", [0, 1, 2])
@pytest.mark.parametrize("value", [-0.1, 1.1])
def test_one_channel_beyond_one_end_is_outside_the_gamut(tmp_path: Path, channel: int, value: float) -> None:
    color = np.full(3, 0.5)
    color[channel] = value
    assert write_swatches(tmp_path / "s.gpl", [Swatch("one", color)], clip=True) == ("one",)
    assert write_swatches(tmp_path / "s.gpl", [Swatch("in", np.array([0.0, 0.5, 1.0]))]) == ()


def test_gray_is_read_and_other_models_are_refused(tmp_path: Path) -> None:
    def ase(model: bytes, values: tuple[float, ...]) -> Path:
        content = b"\x00\x02\x00A\x00\x00" + model + struct.pack(f">{len(values)}f", *values) + b"\x00\x00"
        data = b"ASEF\x00\x01\x00\x00\x00\x00\x00\x01\x00\x01" + struct.pack(">I", len(content)) + content
        (tmp_path / "x.ase").write_bytes(data)
        return tmp_path / "x.ase"

    assert read_swatches(ase(b"Gray", (1.0,)))[0].linear_rgb.tolist() == [1, 1, 1]
    with pytest.raises(FileFormatError, match=r"x\.ase: swatch 'A' is in 'CMYK'; expected RGB or Gray"):
        read_swatches(ase(b"CMYK", (0, 0, 0, 1)))


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "s.ase"
    write_swatches(path, SWATCHES)
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(FileFormatError, match=r"s\.ase: the \.ase file is truncated or edited near byte \d+"):
        read_swatches(path)
    (tmp_path / "s.gpl").write_text("GIMP Palette\n255 0 zero red\n", encoding="utf-8")
    with pytest.raises(FileFormatError, match=r"s\.gpl, line 2: .*expected three numbers to 255 and a name"):
        read_swatches(tmp_path / "s.gpl")
    (tmp_path / "s.gpl").write_text("JASC-PAL\n", encoding="utf-8")
    with pytest.raises(FileFormatError, match=r"line 1: 'JASC-PAL'; expected 'GIMP Palette'"):
        read_swatches(tmp_path / "s.gpl")
    with pytest.raises(InvalidInputError, match=r"cannot tell the swatch format of 's\.aco'"):
        write_swatches(tmp_path / "s.aco", SWATCHES)
    with pytest.raises(FileFormatError, match=r"there is no file .*no\.ase"):
        read_swatches(tmp_path / "no.ase")


@pytest.mark.parametrize(("model", "channels"), [(b"RGB ", (0.1, np.nan, 0.2)), (b"Gray", (np.inf,))])
def test_channels_that_are_no_numbers_are_refused_with_the_file(tmp_path: Path, model: bytes, channels) -> None:
    color = model + struct.pack(f">{len(channels)}f", *channels) + b"\x00\x02"
    content = b"\x00\x02\x00A\x00\x00" + color
    block = struct.pack(">HI", 1, len(content)) + content
    (tmp_path / "odd.ase").write_bytes(b"ASEF" + struct.pack(">HHI", 1, 0, 1) + block)
    with pytest.raises(FileFormatError, match=r"odd\.ase: swatch 'A' has the channels .*; expected finite numbers"):
        read_swatches(tmp_path / "odd.ase")


def test_blocks_beyond_the_stated_count_are_no_lost_swatches(tmp_path: Path) -> None:
    path = tmp_path / "two.ase"
    write_swatches(path, [Swatch("first", np.zeros(3)), Swatch("second", np.ones(3))])
    data = path.read_bytes()
    path.write_bytes(data[:8] + b"\0\0\0\1" + data[12:])
    with pytest.raises(FileFormatError, match="its header states 1 block, and [0-9]+ bytes follow"):
        read_swatches(path)
    path.write_bytes(data + b"\0\0")
    assert [swatch.name for swatch in read_swatches(path)] == ["first", "second"]
