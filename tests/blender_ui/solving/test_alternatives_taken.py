# SPDX-License-Identifier: GPL-3.0-or-later
"""A taken alternative is one solution: its spectra, colors and status belong together, and to these rows."""

from __future__ import annotations

from types import SimpleNamespace

import colour
import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
"""From XYZ to linear sRGB, as IEC 61966-2-1 prints it."""


def stored(entry, wavelengths_nm: np.ndarray) -> np.ndarray:
    samples = np.array([(each.wavelength_nm, each.value) for each in entry.result.samples])
    return np.interp(wavelengths_nm, *samples.T, left=0.0, right=0.0)


def integrated(palette) -> np.ndarray:
    """Linear sRGB of all cells, by the color matching functions of colour-science."""
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    nm = np.arange(360.0, 830.0001, 0.1)
    cmfs = np.array([np.interp(nm, observer.wavelengths, row) for row in observer.values.T])
    lights = [stored(light, nm) for light in palette.lights]
    surfaces = [stored(material, nm) for material in palette.materials]
    return np.array([[0.1 * SRGB @ (cmfs * light * paint).sum(axis=1) for light in lights] for paint in surfaces])


def actual(palette) -> np.ndarray:
    return np.array([[tuple(cell.actual_linear) for cell in row.cells] for row in palette.materials])


@pytest.fixture
def twins(blender):
    """Two rows with the same requests, which leave the color under the second light free."""
    blender.ops.wm.read_factory_settings(use_empty=True)
    palette = bpy.context.scene.spectral.palette
    palette.live = False
    for side in ("LIGHT", "LIGHT", "MATERIAL", "MATERIAL"):
        bpy.ops.spectral.palette_add(side=side)
    palette.lights[1].spectral.catalogue_name = "HP1"
    for row in palette.materials:
        row.cells[0].mode = "FIXED"
    bpy.ops.spectral.palette_solve()
    bpy.ops.spectral.palette_alternatives()
    return palette


def test_an_alternative_keeps_colors_and_spectra_together(twins) -> None:
    bpy.ops.spectral.palette_alternative_take(index=1)
    first, second = actual(twins)
    assert np.abs(first[1] - second[1]).max() > 0.02  # so that an exchange of both rows would be seen
    np.testing.assert_allclose(actual(twins), integrated(twins), atol=2e-4)


def test_an_alternative_of_rows_in_another_order_is_refused(twins) -> None:
    from blender_addon.panels.palette.more import draw_alternatives
    from tests.blender_ui.words.test_long_names import Texts

    bpy.ops.spectral.palette_move(side="MATERIAL", direction="BACK")
    with pytest.raises(RuntimeError, match="the table has changed since this alternative was found"):
        bpy.ops.spectral.palette_alternative_take(index=1)
    bpy.ops.spectral.palette_solve()
    np.testing.assert_allclose(actual(twins), integrated(twins), atol=2e-4)
    layout = Texts()
    region = SimpleNamespace(width=300, type="UI")
    draw_alternatives(layout, SimpleNamespace(scene=bpy.context.scene, region=region, preferences=None))
    assert "find alternatives again" in " ".join(layout.found)


def test_an_alternative_has_a_status_of_its_own(twins) -> None:
    """A locked material cannot follow a new target; the table kept the status of the targets before."""
    twins.materials[0].locked = True
    twins.materials[0].cells[0].target = (0.9, 0.1, 0.1)
    assert (twins.status, twins.is_stale) == ("solved", True)
    bpy.ops.spectral.palette_alternatives()
    bpy.ops.spectral.palette_alternative_take(index=0)
    assert twins.worst_delta_e > 20
    assert (twins.status, twins.is_stale) == ("compromise", False)
    twins.materials[0].locked = False
    bpy.ops.spectral.palette_alternatives()
    bpy.ops.spectral.palette_alternative_take(index=0)
    assert twins.worst_delta_e < 0.1 and twins.status == "solved"
