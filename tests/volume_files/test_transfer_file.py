# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions in files: round trips, conversion of units for a volume, errors that state their position."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_core.documents import toml_text
from spectral_core.documents.schema import KNOWN_WORDS
from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.spectra import catalogue
from spectral_core.spectra.observer import linear_rgb_from_product, normalized
from spectral_core.spectra.spectrum import SpectralGrid
from spectral_core.volume.documents.transfer_document import (
    TRANSFER_SCHEMA,
    TransferDocument,
    document_of,
    transfer_of,
)
from spectral_core.volume.documents.transfer_file import read_transfer, write_transfer
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.mitsuba_integrator.illumination import display_matrix
from spectral_core.volume.transfer import Material, TransferFunction

EXAMPLES = Path(__file__).parents[2] / "examples" / "transfer"
HEAD = 'format = "spectral-scene transfer function"\nversion = 1\n'
BONE = '[[materials]]\nname = "bone"\nvalues = [0, 1]\nextinction = [0, 2]\ncolor = "#ff0000"\n'


def same(one: TransferDocument, other: TransferDocument) -> None:
    assert (one.values, one.length, one.title) == (other.values, other.length, other.title)
    assert one.transfer.names == other.transfer.names
    if one.transfer.wavelengths_nm is None:
        assert other.transfer.wavelengths_nm is None
    else:
        assert np.array_equal(one.transfer.wavelengths_nm, other.transfer.wavelengths_nm)
    for a, b in zip(one.transfer.materials, other.transfer.materials, strict=True):
        for name in ("values", "extinction", "emission", "color", "gradient_values", "gradient_weights"):
            left, right = getattr(a, name), getattr(b, name)
            assert (left is None) == (right is None)
            assert left is None or np.array_equal(left, right), name
        assert a.lit == b.lit


finite = st.floats(0, 1e6, allow_subnormal=False)
knots = st.lists(st.floats(-1e4, 1e4, allow_subnormal=False), min_size=1, max_size=6).map(sorted)


@st.composite
def documents(draw):
    grid = draw(st.sampled_from([None, SpectralGrid.uniform(), SpectralGrid(np.array([400.0, 413.0, 700.0]))]))
    names = draw(st.lists(st.text(min_size=1, max_size=8), min_size=1, max_size=4, unique=True))
    materials = []
    for name in names:
        values = draw(knots)
        curve = st.lists(finite, min_size=len(values), max_size=len(values))
        extinction, emission = draw(curve), draw(curve)
        if not any(extinction) and not any(emission):
            emission[0] = 1.0
        size = 3 if grid is None else grid.size
        color = draw(st.lists(st.floats(0, 1), min_size=size, max_size=size))
        gradient = {}
        if draw(st.booleans()):
            gradient = {"gradient_values": draw(knots), "gradient_weights": None}
            length = len(gradient["gradient_values"])
            gradient["gradient_weights"] = draw(st.lists(finite, min_size=length, max_size=length))
        lit = draw(st.booleans())
        materials.append(Material(name, values, extinction, color, emission, lit, **gradient))
    transfer = TransferFunction(tuple(materials), None if grid is None else grid.wavelengths_nm)
    values, length = draw(st.sampled_from(["data", "fraction"])), draw(st.sampled_from(["world", "voxel"]))
    return TransferDocument(transfer, values, length, draw(st.text(max_size=12)))


@given(documents())
@settings(max_examples=30)
def test_written_functions_are_read_back(stated):
    document = document_of(stated)
    same(transfer_of(tomllib.loads(toml_text(document)), Path()), stated)
    same(transfer_of(json.loads(json.dumps(document)), Path()), stated)


@pytest.mark.parametrize("name", ["tf.toml", "tf.json"])
def test_toml_and_json_files_are_read(tmp_path, name):
    stated = read_transfer(EXAMPLES / "painted.toml")
    write_transfer(tmp_path / name, stated, comment="made by a test\nof two lines")
    same(read_transfer(tmp_path / name), stated)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_examples_are_read_and_fit_a_volume(path):
    volume = ScalarVolume.from_spacing("v", np.arange(60.0).reshape(3, 4, 5), (2.0, 2.0, 2.0))
    fitted = read_transfer(path).for_volume(volume)
    assert all(np.any(m.extinction) or np.any(m.emission) for m in fitted.materials)
    assert display_matrix(fitted).shape == (len(fitted.materials), 3)


def test_fractions_and_voxels_become_data_values_and_world_units():
    material = Material("m", [0.0, 0.5, 1.0], [0, 1, 2], [1, 1, 1], [0, 0, 4], True, [0.1], [1.0])
    stated = TransferDocument(TransferFunction((material,)), "fraction", "voxel")
    volume = ScalarVolume("v", np.array([[[-100.0, 300.0]]]), np.diag([2.0, 4.0, 1.0, 1.0]))  # a voxel of 8 is 2 long
    fitted = stated.for_volume(volume).materials[0]
    assert fitted.values.tolist() == [-100, 100, 300]
    assert fitted.extinction.tolist() == pytest.approx([0, 0.5, 1])
    assert fitted.emission.tolist() == pytest.approx([0, 0, 2])
    assert fitted.gradient_values.tolist() == pytest.approx([0.1 * 400 / 2])
    same(TransferDocument(TransferDocument(stated.transfer).for_volume(volume)), TransferDocument(stated.transfer))


def test_a_constant_volume_accepts_a_function_of_fractions():
    stated = read_transfer(EXAMPLES / "wide.toml")
    fitted = stated.for_volume(ScalarVolume("flat", np.full((2, 2, 2), 7, np.uint8)))
    assert fitted.materials[0].values.tolist() == pytest.approx([0.7, 2.1, 3.5])


def test_colors_of_every_type_are_read(tmp_path):
    (tmp_path / "paint.csv").write_text("wavelength,ochre,umber\n400,0.1,0.2\n700,0.9,0.4\n")
    lines = [
        HEAD + "[wavelengths]\nstart_nm = 400\nstop_nm = 700\nstep_nm = 100\n",
        '[[materials]]\nname = "a"\nvalues = [0]\nextinction = [1]\ncolor = {catalogue = "orange"}\n',
        '[[materials]]\nname = "b"\nvalues = [0]\nextinction = [1]\ncolor = {file = "paint.csv", name = "ochre"}\n',
        '[[materials]]\nname = "c"\nvalues = [0]\nemission = [1]\ncolor = {values = [0, 1, 2, 3]}\nlit = false\n',
        '[[materials]]\nname = "d"\nvalues = [0]\nextinction = [1]\n',
        "color = {values = [0, 1], wavelengths_nm = [400, 700]}\n",
    ]
    (tmp_path / "a.toml").write_text("\n".join(lines))
    transfer = read_transfer(tmp_path / "a.toml").transfer
    grid = SpectralGrid(transfer.wavelengths_nm)
    assert np.allclose(transfer.colors[0], catalogue.reflectance("orange").resampled(grid).values)
    assert transfer.colors[1].tolist() == pytest.approx([0.1, 0.1 + 0.8 / 3, 0.1 + 1.6 / 3, 0.9])
    assert transfer.colors[2].tolist() == [0, 1, 2, 3]
    assert transfer.colors[3].tolist() == pytest.approx([0, 1 / 3, 2 / 3, 1])


def test_hex_and_linear_colors_are_read(tmp_path):
    second = BONE.replace("bone", "b").replace('"#ff0000"', "[0.25, 0.5, 1.0]")
    (tmp_path / "a.toml").write_text(HEAD + BONE.replace("ff0000", "ff8000") + second)
    colors = read_transfer(tmp_path / "a.toml").transfer.colors
    assert colors[0] == pytest.approx([1.0, 0.215861, 0.0], abs=1e-6)
    assert colors[1].tolist() == [0.25, 0.5, 1.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("version = 1", "has no 'format'"),
        (HEAD, "has no 'materials'"),
        (HEAD.replace("1", "2") + BONE, r"version is 2; expected 1"),
        (HEAD + "materials = []", "materials has 0 entries; expected at least 1"),
        (HEAD + 'values = "percent"\n' + BONE, "values is \"percent\"; expected one of 'data', 'fraction'"),
        (HEAD + BONE + "colour = 3", r"materials\[0\] has the unknown entry 'colour'; known: color"),
        (HEAD + BONE.replace("[0, 1]", '[0, "x"]'), r"materials\[0\].values\[1\] is \"x\"; expected a number"),
        (
            HEAD + BONE.replace("#ff0000", "#ff00"),
            r"materials\[0\].color is \"#ff00\"; expected #rrggbb",
        ),
        (HEAD + BONE.replace('"#ff0000"', "true"), "color is true; expected a text or a list or a table"),
        (HEAD + BONE.replace('"#ff0000"', "[1, 0]"), r"color has 2 entries; expected 3"),
        (HEAD + BONE.replace("[0, 1]", "[1, 0]"), r"materials\[0\] \(bone\): values of material 'bone' must be"),
        (HEAD + BONE.replace("[0, 2]", "[0, -2]"), "negative entry -2"),
        (HEAD + BONE.replace("[0, 2]", "[0, nan]"), "not finite"),
        (HEAD + BONE.replace("[0, 2]", "[2]"), r"shape \(1,\); expected a list of 2 numbers"),
        (HEAD + BONE.replace("extinction = [0, 2]\n", ""), "neither extinction nor emission"),
        (HEAD + BONE + BONE, "share a name"),
        (HEAD + BONE.replace('"#ff0000"', '{catalogue = "orange"}'), r"no \[grid\]; add one"),
        (HEAD + "[wavelengths]\nwavelengths_nm = [400, 700]\n" + BONE, "give all of them spectra"),
        (
            HEAD + "[wavelengths]\nstart_nm = 400\n" + BONE,
            "wavelengths: grid gives start_nm; expected start_nm, stop_nm and step_nm",
        ),
        (
            HEAD + "[wavelengths]\nwavelengths_nm = [700, 400]\n" + BONE,
            "wavelengths: wavelengths_nm must be at least 2",
        ),
        (HEAD + BONE + "gradient = {values = [1]}", "gradient has no 'weights'"),
        ("format = ", "expected a transfer function in TOML"),
    ],
)
def test_errors_of_invalid_files_state_their_position(tmp_path, text, message):
    (tmp_path / "odd.toml").write_text(text)
    with pytest.raises(FileFormatError, match=message):
        read_transfer(tmp_path / "odd.toml")


@pytest.mark.parametrize(
    ("color", "message"),
    [
        ('{catalogue = "orang"}', "no reflectance is named 'orang'; did you mean 'orange'"),
        ('{catalogue = "orange", values = [1, 1]}', "gives catalogue and values; expected one of"),
        ("{name = 'x'}", "gives nothing; expected one of"),
        ('{file = "paint.csv"}', "holds 2 spectra; say which by name"),
        ('{file = "paint.csv", name = "ocre"}', "did you mean 'ochre'"),
        ("{values = [2, 2]}", "spans 2 to 2"),
        ("{values = [1]}", "has 1 entry; expected at least 2"),
    ],
)
def test_errors_of_invalid_spectra_state_their_position(tmp_path, color, message):
    (tmp_path / "paint.csv").write_text("wavelength,ochre,umber\n400,0.1,0.2\n700,0.9,0.4\n")
    text = HEAD + "[wavelengths]\nwavelengths_nm = [400, 700]\n" + BONE.replace('"#ff0000"', color)
    (tmp_path / "odd.toml").write_text(text)
    with pytest.raises(FileFormatError, match=message):
        read_transfer(tmp_path / "odd.toml")


def test_folders_and_missing_files_are_refused(tmp_path):
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileFormatError, match="not UTF-16 text|binary file"):
        read_transfer(tmp_path / "binary.toml")
    with pytest.raises(InvalidInputError, match="there is no file"):
        read_transfer(tmp_path / "missing.toml")
    with pytest.raises(InvalidInputError, match="name transfer functions .toml or .json"):
        write_transfer(tmp_path / "a.yaml", read_transfer(EXAMPLES / "wide.toml"))


def test_the_schema_uses_only_keywords_that_are_checked():
    def words(node):
        if isinstance(node, dict):
            for key, value in node.items():
                yield key
                if key in ("properties", "$defs"):
                    for item in value.values():
                        yield from words(item)
                else:
                    yield from words(value)
        elif isinstance(node, list):
            for item in node:
                yield from words(item)

    assert set(words(TRANSFER_SCHEMA.content)) <= KNOWN_WORDS
    json.dumps(TRANSFER_SCHEMA.content)


# Colors of materials under a light


def test_lit_materials_reflect_the_light_and_emissive_ones_do_not():
    grid = SpectralGrid.uniform(380, 780, 10)
    orange = catalogue.reflectance("orange").resampled(grid).values
    flat = np.ones(grid.size)
    materials = (Material("lit", [0], [1], orange), Material("own", [0], [1], flat, lit=False))
    transfer = TransferFunction(materials, grid.wavelengths_nm)
    daylight, sodium = display_matrix(transfer), display_matrix(transfer, catalogue.illuminant("HP1"))
    lamp = normalized(catalogue.illuminant("HP1"))
    assert sodium[0] == pytest.approx(linear_rgb_from_product(lamp, grid) @ orange)
    assert np.array_equal(daylight[1], sodium[1])
    assert daylight[1] @ [0.2126, 0.7152, 0.0722] == pytest.approx(1.0, abs=1e-3)


def test_white_under_daylight_is_white():
    white = TransferFunction((Material("w", [0], [1], [1, 1, 1]),))
    assert display_matrix(white)[0].tolist() == [1, 1, 1]
    assert display_matrix(white, catalogue.illuminant("D65"))[0] == pytest.approx([1, 1, 1])
    warm = display_matrix(white, catalogue.illuminant("A"))[0]
    assert warm[0] > 1.3 > 0.5 > warm[2]


def test_a_written_material_has_no_empty_curves():
    only_absorbs = Material("a", [0, 1], [0, 1], [1, 1, 1])
    only_emits = Material("b", [0, 1], [0, 0], [1, 1, 1], [0, 1])
    document = document_of(TransferDocument(TransferFunction((only_absorbs, only_emits)), "data", "world", ""))
    first, second = document["materials"]
    assert ("extinction" in first, "emission" in first) == (True, False)
    assert ("extinction" in second, "emission" in second) == (False, True)


def test_an_invisible_material_is_read_back(tmp_path: Path) -> None:
    """Its file had neither extinction nor emission, and was refused."""
    off = Material("off", [0, 1], [0.0, 0.0], [1.0, 0.5, 0.0], emission=[0.0, 0.0])
    write_transfer(tmp_path / "t.toml", TransferFunction((off,)))
    assert read_transfer(tmp_path / "t.toml").transfer.names == ("off",)
