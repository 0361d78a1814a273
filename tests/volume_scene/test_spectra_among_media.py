# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampled volumes among media keep the spectra of their materials: closed forms of a slab beside fog."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import (
    Camera,
    Film,
    Instance,
    Material,
    RenderSettings,
    ScatteringMedium,
    Scene,
    VolumeObject,
    gray,
)
from spectral_core.scene.geometry import unit_box
from spectral_core.spectra import catalogue
from spectral_core.spectra.observer import STANDARD, observer
from spectral_core.spectra.spectrum import WAVELENGTHS_NM
from spectral_core.volume.transfer import Material as VolumeMaterial
from spectral_core.volume.transfer import TransferFunction

NM = np.arange(380.0, 781.0, 5.0)
ORANGE = np.where((NM > 565) & (NM < 615), 0.9, 0.02)
PURPLE = np.where((NM > 615) | (NM < 500), 0.6, 0.05)
DEPTHS = np.array([0.7, 0.5])
"""Optical depth of the orange and of the purple material."""


def shown(*, lit: bool) -> np.ndarray:
    """Spectral channels of a slab in even light, 1 thick, of both materials; fog stands behind it."""
    materials = tuple(
        VolumeMaterial(name, [0.0, 2.0], [depth] * 2, color, lit=lit)
        for name, depth, color in zip(("orange", "purple"), DEPTHS, (ORANGE, PURPLE), strict=True)
    )
    place = np.diag([1.0, 1.0, 0.5, 1.0])
    place[:3, 3] = -0.5, -0.5, -0.25
    transfer = TransferFunction(materials, NM)
    slab = VolumeObject("slab", np.ones((2, 2, 2), np.float32), place, transfer, lighting="even")
    eye, behind = np.eye(4), np.eye(4)
    eye[2, 3], behind[:3, 3] = 4.0, (-0.5, -0.5, -3.0)
    scene = Scene(
        camera=Camera(world_from_camera=eye, kind="orthographic", orthographic_scale=0.2),
        film=Film(4, 4, samples=64),
        volumes=(slab,),
        meshes=(unit_box(),),
        instances=(Instance("fog", unit_box().name, behind, ("fog",)),),
        materials=(Material("fog", None, medium=ScatteringMedium(0.5, gray(0.0))),),
        settings=RenderSettings(transport="spectral"),
    )
    made = render_scene(scene, bands=BANDS)
    assert any("rendered as media" in note.message for note in made.notes)
    assert made.band_pixels is not None
    return made.band_pixels.mean(axis=(0, 1))


BANDS = Bands.uniform(400, 700, 6)


@pytest.mark.parametrize("lit", [True, False])
def test_materials_of_a_volume_keep_their_spectra_beside_fog(lit):
    """They had spectra of their colors in daylight, so that metamers looked alike under every lamp."""
    share = 1 - np.exp(-DEPTHS.sum())
    colors = np.array([np.interp(WAVELENGTHS_NM, NM, each, left=0.0, right=0.0) for each in (ORANGE, PURPLE)])
    radiance = share * DEPTHS / DEPTHS.sum() @ colors
    luminous = np.interp(WAVELENGTHS_NM, observer(STANDARD).wavelengths_nm, observer(STANDARD).cmfs[1])
    white = catalogue.illuminant("D65").at(WAVELENGTHS_NM) if lit else np.ones_like(WAVELENGTHS_NM)
    expected = BANDS.responses @ (radiance * white) / float(luminous @ white)
    np.testing.assert_allclose(shown(lit=lit), expected, rtol=0.05)
