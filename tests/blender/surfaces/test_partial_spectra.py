# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of spectra that the eye sees in part or not at all, and of values in any unit."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.spectra.spectrum import Illuminant, Reflectance

pytest.importorskip("bpy")


def table(folder, wavelengths, values):
    path = folder / "measured.csv"
    rows = [f"{nm!r},{value!r}\n" for nm, value in zip(wavelengths, values, strict=True)]
    path.write_text("wavelength_nm,sample\n" + "".join(rows))
    return str(path)


def from_file(owner, path):
    owner.spectral.source, owner.spectral.filepath = "FILE", path
    assert owner.spectral.message == ""
    return owner


@pytest.mark.parametrize("wavelengths", [(300.0, 320.0, 350.0), (900.0, 1000.0, 1100.0)])
def test_a_lamp_that_the_eye_does_not_see_is_dark_and_the_others_shine(build, translate, tmp_path, wavelengths):
    """It ended the render of the whole scene, by an error that named no lamp."""
    from_file(build.light("POINT").data, table(tmp_path, wavelengths, [1.0, 2.0, 1.0]))
    build.light("SUN")
    scene = translate()
    by_name = {light.name: light for light in scene.lights}
    assert isinstance(by_name["Point"].color, Illuminant) and not np.any(by_name["Point"].color.values)
    assert np.any(by_name["Sun"].color.linear_rgb)
    (note,) = scene.notes
    assert note.subject == "Point" and "it is dark" in note.message


@pytest.mark.parametrize("line", [(359.0, 360.5, 361.0), (829.0, 829.5, 831.0), (532.1, 532.2, 532.3)])
def test_lamps_with_little_visible_light_are_kept(build, translate, tmp_path, line):
    from_file(build.light("POINT").data, table(tmp_path, line, [0.0, 1.0, 0.0]))
    scene = translate()
    assert not scene.notes and np.any(scene.lights[0].color.values)


@pytest.mark.parametrize(
    ("ends", "is_told"), [((380, 730), False), ((400, 700), False), ((420, 680), True), ((900, 2500), True)]
)
def test_a_surface_that_is_known_in_part_has_a_note(build, translate, tmp_path, ends, is_told):
    """Beyond its file it is black: ΔE2000 of a white is 0.40 from 400 to 700 nm, and 3.9 from 420 to 680 nm."""
    knots = np.linspace(*ends, 8).tolist()
    from_file(build.plane(material=build.material()).active_material, table(tmp_path, knots, [0.8] * 8))
    notes = [note.message for note in translate().notes]
    assert any("beyond, it is black" in message for message in notes) is is_told


@pytest.mark.parametrize("unit", [1e-46, 1e-30, 1.0, 1e39, 1e300])
def test_values_of_a_lamp_may_have_any_unit(build, translate, tmp_path, unit):
    """Blender stores single precision, where 1e39 is infinite and 1e-46 is 0: the shape of the spectrum was lost."""
    shape = np.array([0.1, 0.7, 2.0, 1.0])
    from_file(build.light("POINT").data, table(tmp_path, [400.0, 500.0, 600.0, 700.0], (shape * unit).tolist()))
    values = translate().lights[0].color.values
    np.testing.assert_allclose(values / values.max(), shape / 2, rtol=1e-6)


def test_reflectances_are_stored_as_they_are(build, translate, tmp_path):
    dark = [0.0, 1e-9, 1e-9, 0.0]
    surface = build.plane(material=build.material()).active_material
    from_file(surface, table(tmp_path, [380.0, 500.0, 600.0, 780.0], dark))
    translate()
    from blender_addon.translate.spectra import stored

    found = stored.spectrum_of(surface)
    assert isinstance(found, Reflectance)
    np.testing.assert_allclose(found.values, dark, rtol=1e-6)
