# SPDX-License-Identifier: GPL-3.0-or-later
"""Every file format keeps names of any length and script; names that no file can hold are refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette import PaletteReflectance
from spectral_core.palette.files import read_palette, write_palette
from spectral_core.palette.presets import hidden_mark
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.files import read_spectra, write_spectra
from spectral_core.spectra.spectrum import Spectrum

NAMES = (
    "x" * 5000, "a\nb", "tab\there", "q\"u'o<te>&{}[]", "/..\\:*?|", "emoji 🎨 é", "  ", " lead", "R", "1 A",
    "\u202eevil", "#", "= 1", "%s", "wavelength_nm", "true",
)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("ending", ["toml", "json"])
def test_palettes_keep_any_name(tmp_path: Path, name: str, ending: str) -> None:
    problem = hidden_mark()
    problem = replace(problem, reflectances=(PaletteReflectance(name), problem.reflectances[1]))
    write_palette(tmp_path / f"a.{ending}", problem)
    assert read_palette(tmp_path / f"a.{ending}").reflectances[0].name == name


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("ending", ["csv", "spdx"])
def test_spectra_keep_any_name_except_for_blanks(tmp_path: Path, name: str, ending: str) -> None:
    light = illuminant("D65")
    write_spectra(tmp_path / f"a.{ending}", [Spectrum(name, light.grid, light.values)])
    (back,) = read_spectra(tmp_path / f"a.{ending}")
    if name.strip():
        assert back.name.split() == name.split()
    np.testing.assert_array_equal(back.values, light.values)


@pytest.mark.parametrize("name", NAMES)
def test_recordings_keep_any_name(tmp_path: Path, name: str) -> None:
    pytest.importorskip("OpenEXR")
    from spectral_core.render.relight.storage import MixtureStorage
    from spectral_core.render.relight.transport import Transport
    from spectral_core.render.relight.transport_file import read_transport, write_transport

    pixels = np.ones((2, 3, 4, 5), np.float32)
    made = Transport(MixtureStorage(), (name, "other"), pixels, pixels[0, 0], (None, None), 1.0, "h", 1, 0)
    write_transport(tmp_path / "a.exr", made)
    assert read_transport(tmp_path / "a.exr").groups == made.groups


@pytest.mark.parametrize("name", ["\x00", "a\x00b", "\ud800", "caf\udce9"])
def test_names_that_no_file_can_hold_are_refused_at_the_start(name: str) -> None:
    light = illuminant("D65")
    with pytest.raises(InvalidInputError, match="the name of a spectrum is .*, which no file can store; rename it"):
        Spectrum(name, light.grid, light.values)
    with pytest.raises(InvalidInputError, match="the name of a reflectance is"):
        PaletteReflectance(name)


def test_a_light_group_that_no_file_can_hold_is_refused_before_rendering() -> None:
    pytest.importorskip("mitsuba")
    from spectral_core.render.relight.storage import MixtureStorage
    from spectral_core.render.relight.transport import record_transport
    from spectral_core.scene import PointLight
    from tests.render.scenes import lit_plane, looking_down, matrix

    lamp = PointLight(name="caf\udce9", world_from_light=matrix((0, 0, 3)), power_w=60, group="caf\udce9")
    with pytest.raises(InvalidInputError, match="the name of a light group is"):
        record_transport(lit_plane(lamp, camera=looking_down(8, 0.5)), MixtureStorage(), render=None)


@pytest.mark.parametrize("ending", ["csv", "spd", "spdx"])
def test_a_file_whose_name_is_not_utf8_is_read_and_its_spectra_are_written(tmp_path: Path, ending: str) -> None:
    """Its name is the source of its spectra, which no TOML file and no table could state: writing ended in an error."""
    light = illuminant("D65")
    write_spectra(tmp_path / f"a.{ending}", [Spectrum("caf", light.grid, light.values)])
    try:
        odd = (tmp_path / f"a.{ending}").rename(tmp_path / f"caf\udce9.{ending}")
    except OSError:
        pytest.skip("this system has no such file names")
    if ending == "csv":
        odd.write_text("400 1\n500 2\n600 1.5\n")
    (lamp,) = read_spectra(odd, kind="illuminant")
    assert lamp.source.startswith("caf") or ending != "csv"
    write_spectra(tmp_path / "back.csv", [lamp])
    problem = hidden_mark()
    lights = (replace(problem.lights[0], spectrum=lamp), problem.lights[1])
    for name in ("back.toml", "back.json"):
        write_palette(tmp_path / name, replace(problem, lights=lights))
        assert read_palette(tmp_path / name).lights[0].spectrum.source == lamp.source
    with pytest.raises(InvalidInputError, match="the source of spectrum 'caf"):
        Spectrum("caf", light.grid, light.values, source="caf\udce9")
