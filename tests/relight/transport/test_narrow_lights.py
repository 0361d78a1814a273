# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings of lights that few of the wavelengths of any light hit: colors outside of sRGB, and laser lines."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.storages import storage_named
from spectral_core.render.relight.transport import record_transport
from spectral_core.scene import Color, Diffuse, Film, Light, Paint, Scene, SunLight, World, gray
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from tests.render.scenes import lit_plane, matrix

pytest.importorskip("mitsuba")

# linear sRGB of the primaries, from the chromaticities in ITU-R BT.2020
RED, GREEN, BLUE = (1.6605, -0.1246, -0.0182), (-0.5876, 1.1329, -0.1006), (-0.0728, -0.0083, 1.1187)
LASER = Illuminant("laser", SpectralGrid(np.array([531.0, 532.0, 533.0])), np.array([0.0, 1.0, 0.0]))


def _sun(name: str, color: Paint) -> Light:
    return SunLight(name=name, group=name, world_from_light=matrix((0, 0, 3)), irradiance=np.pi, color=color)


def _scene(color: Paint, **rest: object) -> Scene:
    lamps = (_sun("Narrow", color), _sun("White", gray(1.0)))
    return lit_plane(*lamps, transport="spectral", film=Film(24, 24, samples=64), **rest)


def _noise(pixels: np.ndarray) -> float:
    """Standard deviation of pixels of equal light, of all channels together."""
    return float(np.sqrt(pixels[..., :3].var(axis=(0, 1)).sum()))


@pytest.mark.parametrize(
    ("storage", "sky"),
    [("dial", BLUE), ("bands31", RED), ("bands61", GREEN), ("bands121", BLUE), ("exact", GREEN)],
    ids=["dial", "bands31", "bands61", "bands121", "exact"],
)
def test_colors_outside_of_srgb_are_recorded_without_bias(storage: str, sky: tuple[float, float, float]) -> None:
    """A gray plane under a lamp of each color, a white one, and a world of a color: half of their sum."""
    colors = {"Red": RED, "Green": GREEN, "Blue": BLUE, "White": (1.0, 1.0, 1.0), "Sky": sky}
    lamps = [_sun(name, Color(np.array(colors[name]))) for name in colors if name != "Sky"]
    world = World(Color(np.array(sky)), 1.0, group="Sky")
    scene = lit_plane(*lamps, transport="spectral", film=Film(24, 24, samples=64), world=world)
    transport = record_transport(scene, storage_named(storage))
    for lit in ("Red", "Green", "Blue", "Sky"):
        mix = dict.fromkeys(colors, 0.0) | {lit: 1.0, "White": 0.0 if lit == "Sky" else 0.5}
        relit = relight(transport, mix=mix)[..., :3]
        error = relit.std(axis=(0, 1)) / np.sqrt(relit[..., 0].size)
        wanted = (np.array(colors[lit]) + mix["White"]) / 2
        # the color itself has an error of the smoothest spectrum
        np.testing.assert_array_less(np.abs(relit.mean(axis=(0, 1)) - wanted), 4 * error + 0.003)


@pytest.mark.parametrize(
    ("storage", "color"),
    [("bands61", Color(np.array(BLUE))), ("bands61", LASER), ("exact", Color(np.array(GREEN))), ("exact", LASER)],
    ids=["bands61-blue", "bands61-laser", "exact-green", "exact-laser"],
)
def test_narrow_lights_have_little_noise(storage: str, color: Paint) -> None:
    """Of wavelengths drawn for any light the noise was 0.13 to 0.30 of white; the white lamp's share is 0.01."""
    transport = record_transport(_scene(color), storage_named(storage))
    assert _noise(relight(transport)) < 0.15
    if not isinstance(color, Illuminant):
        assert _noise(relight(transport)) < 0.06
    assert _noise(relight(transport, mix={"Narrow": 0.0, "White": 1.0})) < 0.05


def test_colored_surfaces_under_narrow_lights_equal_their_render() -> None:
    surface = Diffuse(Color(np.array([0.1, 0.6, 0.3])))
    scene = _scene(Color(np.array(GREEN)), surface=surface)
    rendered = render_scene(scene).pixels[..., :3].mean(axis=(0, 1))
    for storage in ("bands121", "exact"):
        relit = relight(record_transport(scene, storage_named(storage)))[..., :3].mean(axis=(0, 1))
        np.testing.assert_allclose(relit, rendered, atol=0.006)
