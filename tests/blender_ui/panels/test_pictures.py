# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of spectra: positions and colors, without a graphics card."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.drawing import icons
from blender_addon.drawing.curve_image import LINE, MARGIN, SPAN_NM, curve_picture, swatch_picture, wavelength_colors
from blender_addon.drawing.curve_plot import Plot, side_by_side
from blender_addon.panels.swatches import LAMPS, NO_SWATCH, swatches_of
from blender_addon.translate.spectra.stored import store_spectrum
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import (
    delta_e_2000,
    display_rgb_from_linear,
    lab_from_linear_rgb,
    linear_from_display_rgb,
)
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

SIZE = 128


@pytest.mark.parametrize("level", [0.0, 0.25, 0.5, 1.0])
def test_a_flat_reflectance_is_a_horizontal_line_at_its_value(level):
    grid = np.array([380.0, 780.0])
    picture = curve_picture(grid, np.full(2, level), "reflectance", SIZE)
    brightness = picture[:, SIZE // 2 + 5, :3].min(axis=1)  # away from the grid lines
    line = np.flatnonzero(brightness > 0.8 * LINE[0])
    expected = (MARGIN + (1 - 2 * MARGIN) * level) * SIZE
    assert line.size
    assert abs(line.mean() + 0.5 - expected) <= 1.0


def test_the_fill_has_the_color_of_its_wavelength_and_lies_below_the_line():
    picture = curve_picture(np.array(SPAN_NM), np.full(2, 0.9), "reflectance", SIZE)
    colors = wavelength_colors(SIZE)
    for column in (20, 50, 75, 100):
        inside = picture[SIZE // 2, column, :3]
        assert np.abs(inside - colors[column]).max() < 0.15
    assert picture[int(SIZE * 0.97), SIZE // 2, :3].max() < 0.3  # above the line: background


def test_hues_run_from_violet_through_green_to_red():
    colors = wavelength_colors(401)
    blue, green, red = colors[450 - 380], colors[530 - 380], colors[640 - 380]
    assert blue.argmax() == 2
    assert green.argmax() == 1
    assert red.argmax() == 0
    assert colors.min() >= 0
    assert colors.max() <= 1


def test_a_light_fills_the_height_and_corners_are_round():
    grid = illuminant("HP1").grid
    picture = curve_picture(grid.wavelengths_nm, illuminant("HP1").values, "illuminant", SIZE)
    assert picture.shape == (SIZE, SIZE, 4)
    assert picture.dtype == np.float32
    assert np.isfinite(picture).all()
    assert picture[0, 0, 3] == 0
    assert picture[SIZE // 2, SIZE // 2, 3] == 1
    top = picture[int(SIZE * (1 - 1.5 * MARGIN)) :, :, :3].min(axis=2).max()
    assert top > 0.5 * LINE[0]  # its peak reaches the top


def test_unphysical_spectra_are_drawn_inside_the_picture():
    picture = curve_picture(np.array([400.0, 500.0, 700.0]), np.array([-1.0, 2.0, 0.5]), "reflectance", SIZE)
    assert np.isfinite(picture).all()
    assert picture.max() <= 1


def test_a_swatch_is_its_color():
    picture = swatch_picture(np.array([0.2, 0.4, 0.6]), 32)
    np.testing.assert_allclose(picture[16, 16], [0.2, 0.4, 0.6, 1.0], rtol=1e-6)


@pytest.fixture
def moment(blender, monkeypatch):
    """No icons but a test's own, three before they are used again, and a time that the test sets."""
    now = [0.0]
    icons.unregister()
    icons.register()
    monkeypatch.setattr(icons, "KEPT", 3)
    monkeypatch.setattr(icons.time, "monotonic", lambda: now[0])
    yield now
    icons.unregister()
    icons.register()


def swatch(level):
    """The preview of a gray swatch; without a window its icon has no number."""
    icons.swatch_icon(np.full(3, level))
    return list(icons._icons.values())[-1].preview


def shown(preview):
    """Color of its middle."""
    width, height = preview.image_size
    pixels = np.empty(width * height * 4, np.float32)
    preview.image_pixels_float.foreach_get(pixels)
    return pixels.reshape(height, width, 4)[height // 2, width // 2, 0]


def test_icons_are_made_once_per_content(blender, moment, monkeypatch):
    material = blender.data.materials.new("m")
    assert icons.curve_icon(material.spectral) == 0
    store_spectrum(material.spectral, reflectance("dark skin"))
    made = []
    original = icons.curve_picture
    monkeypatch.setattr(icons, "curve_picture", lambda *a: made.append(a) or original(*a))
    icons.curve_icon(material.spectral)
    icons.curve_icon(material.spectral)
    assert len(made) == len(icons._previews) == 1


def test_an_icon_that_a_panel_may_show_is_neither_removed_nor_changed(moment):
    """Buttons of regions that are not laid out again refer to it; Blender reported missing icons, and ended later."""
    levels = np.linspace(0, 1, 9)
    previews = [swatch(level) for level in levels]
    moment[0] = icons.UNUSED_S - 1
    swatch(0.33)
    assert len(icons._previews) == 10, "a table may show more than are kept"
    assert [shown(preview) for preview in previews] == pytest.approx(list(levels), abs=0.01)


def test_an_icon_that_nothing_has_used_for_a_while_gets_another_picture(moment):
    previews = [swatch(level) for level in (0.1, 0.2, 0.3, 0.4)]
    moment[0] = 2 * icons.UNUSED_S
    assert swatch(0.1) is previews[0]
    assert swatch(0.9) is previews[1] and len(icons._previews) == 4
    assert [shown(preview) for preview in previews] == pytest.approx([0.1, 0.9, 0.3, 0.4], abs=0.01)
    icons.picture_icon(np.ones((8, 12, 4), np.float32))
    assert len(icons._previews) == 5, "a picture of another size"
    assert shown(swatch(0.2)) == pytest.approx(0.2, abs=0.01)


def test_swatches_of_a_surface_are_its_colors_under_the_lamps(blender):
    material = blender.data.materials.new("m")
    store_spectrum(material.spectral, reflectance("dark skin"))
    swatches = dict(swatches_of(material.spectral))
    assert list(swatches) == [name for name, _ in LAMPS]
    from spectral_core.spectra.color import linear_rgb_from_xyz
    from spectral_core.spectra.observer import normalized, xyz_of

    for name, lamp in LAMPS:
        color = np.clip(linear_rgb_from_xyz(xyz_of(normalized(illuminant(lamp)), reflectance("dark skin"))), 0, 1)
        shown = linear_from_display_rgb(swatches[name])
        assert delta_e_2000(lab_from_linear_rgb(shown), lab_from_linear_rgb(color)) < 0.1
    assert np.abs(swatches["Day"] - display_rgb_from_linear(np.full(3, 0.5))).max() > 0.05


def test_swatches_of_a_light_and_of_one_without_luminance(blender):
    light = blender.data.lights.new("l", "POINT")
    store_spectrum(light.spectral, illuminant("D65"))
    name, color = swatches_of(light.spectral)[0]
    assert name == "Light"
    np.testing.assert_allclose(color, 1.0, atol=0.03)
    store_spectrum(light.spectral, Illuminant("infrared", SpectralGrid([900.0, 1000.0]), np.ones(2)))
    assert swatches_of(light.spectral) == (("No visible light", NO_SWATCH),)


def test_plot_geometry():
    plot = Plot(10.0, 20.0, 400.0, 100.0, 0.0, 2.0)
    points = plot.line(np.array([300.0, 480.0, 900.0]), np.array([0.0, 2.0, 0.0]))
    np.testing.assert_allclose(points[0], [10.0, 20.0 + 100 * 80 / 180])
    np.testing.assert_allclose(points[1], [110.0, 120.0])
    assert points[-1, 0] == 410.0
    assert [mark for mark, _ in plot.ticks()] == [400, 500, 600, 700]
    assert plot.corners().min(axis=0).tolist() == [10.0, 20.0]
    assert plot.corners().max(axis=0).tolist() == [410.0, 120.0]
    partly = plot.line(np.array([500.0, 600.0]), np.ones(2))
    assert partly[0, 0] == plot.across(500.0)  # no curve is drawn outside the known range


def test_plots_share_the_space_or_are_hidden():
    first, second = side_by_side((1200.0, 700.0), [(0, 1), (0, 2)], 16.0)
    assert first.x + first.width < second.x
    assert second.x + second.width <= 1200.0
    assert second.high == 2
    assert side_by_side((200.0, 700.0), [(0, 1), (0, 1)], 16.0) == []


def test_plots_are_drawn_beside_the_dial():
    from blender_addon.drawing.dial_shape import DISC, DialShape

    shape = DialShape.in_region(1300.0, 800.0, left=60.0)
    first, second = side_by_side((1300.0, 800.0), [(0, 1), (0, 1)], 16.0, shape.right)
    assert first.x > shape.x + DISC * shape.unit
    assert first.x + first.width < second.x
    assert second.x + second.width <= 1300.0


def test_reflectances_share_one_scale(blender):
    """A dark paint must look dark beside a bright one, so the plot of a reflectance always ends at 1."""
    grid = SpectralGrid.uniform()
    dark = curve_picture(grid.wavelengths_nm, Reflectance("d", grid, np.full(31, 0.1)).values, "reflectance", SIZE)
    filled = dark[int(SIZE * 0.5), SIZE // 2 + 5, :3]
    assert filled.max() < 0.3


@pytest.mark.parametrize(
    ("active", "count", "fitting", "shown"),
    [
        (0, 3, 5, (0, 3)),
        (0, 15, 5, (0, 5)),
        (7, 15, 5, (5, 10)),
        (14, 15, 4, (11, 15)),
        (8, 9, 2, (7, 9)),
        (2, 3, 0, (2, 3)),
    ],
)
def test_a_narrow_table_shows_the_lights_around_the_selected_one(active, count, fitting, shown):
    from blender_addon.panels.palette.table import page_of

    page = page_of(active, count, fitting)
    assert (page.start, page.stop) == shown
    assert active in page


def test_short_names_stay_distinct():
    from blender_addon.drawing.text import told_apart

    lights = [f"Studio Light {number}" for number in range(1, 9)]
    short = told_apart(lights, 6, len)
    assert len(set(short)) == 8
    assert all(len(name) <= 6 for name in short)
    assert short[7] == "Stud…8"
    assert told_apart(["Day", "Night"], 6, len) == ["Day", "Night"]
    assert told_apart(["A very long single name"], 9, len) == ["A ve…name"]
    assert len(told_apart(["Same name here", "Same name here"], 5, len)[0]) <= 5


def test_a_plot_has_space_for_its_numbers_and_names():
    plot = Plot(100.0, 50.0, 400.0, 200.0, 0.0, 2.0)
    inner = plot.within(left=30, bottom=20, right=10, top=25)
    assert (inner.x, inner.y, inner.width, inner.height) == (130.0, 70.0, 360.0, 155.0)
    low, high = inner.rules()
    assert (low[0, 1], high[0, 1]) == (70.0, 225.0)
    assert (low[0, 0], low[1, 0]) == (130.0, 490.0)
