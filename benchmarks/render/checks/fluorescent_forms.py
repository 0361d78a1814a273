# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescent surfaces with closed forms: light between two surfaces, or between all walls of a room.

Between surfaces that see only each other, radiance is uniform, and L = E + M L' with the bispectral matrix M of
each (Donaldson 1954). The formulas are complete here, on a grid of 0.5 nm, and share no code with the renderer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.render.cases.meshes import at, box, square
from benchmarks.render.checks.closed_forms import Compared, compared, empty_scene, in_bands
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import AddSurface, Camera, Emission, Fluorescent, Instance, Material, World
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.observer import observer
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

Array = NDArray[np.float64]

STEP_NM = 0.5
FINE_NM: Array = np.arange(300.0, 830.0 + STEP_NM / 2, STEP_NM)
KNOTS_NM: Array = np.arange(300.0, 831.0, 5.0)
BELL_NM = 20.0
DYES = {"green": (405.0, 520.0), "red": (525.0, 630.0)}
"""Excitation and emission wavelength of each dye; the second absorbs the emission of the first."""


def fluorescence(samples: int) -> Iterator[Compared]:
    """Two parallel surfaces, one of which is also fluorescent, and a room of one material: per band, and energy in
    all.
    """
    bands = Bands.uniform(420, 700, 15)
    violet = np.exp(-0.5 * ((KNOTS_NM - 410) / 25) ** 2) + 0.02
    glow = Illuminant("violet", SpectralGrid(KNOTS_NM), violet)
    upper, lower = {"green": 0.45}, {"red": 0.45, "green": 0.1}
    light = _emissive(violet)
    matrices = _matrix(upper, 0.25), _matrix(lower, 0.35)
    identity = np.eye(FINE_NM.size)
    seen_lower = np.linalg.solve(identity - matrices[1] @ matrices[0], light)
    expected = {"lower": seen_lower, "upper": matrices[0] @ seen_lower}
    half = 100.0  # with a gap of 1: 1e-4 of the light passes the rim
    scene = replace(
        empty_scene(Camera(world_from_camera=at(), kind="orthographic", orthographic_scale=0.01), samples),
        meshes=(square(),),
        materials=(
            Material("lower", AddSurface(_closure(lower, 0.35), Emission(glow))),
            Material("upper", _closure(upper, 0.25)),
        ),
        instances=(
            Instance("lower", "square", at(scale=(half, half, 1.0)), ("lower",)),
            Instance("upper", "square", at(0, 0, 1.0, scale=(half, half, 1.0), turn=("x", 180)), ("upper",)),
        ),
        world=World(),
    )
    for name, turn in (("lower", 0.0), ("upper", 180.0)):
        eye = replace(scene.camera, world_from_camera=at(0, 0, 0.5, turn=("x", turn)), near=0.01)
        yield from _by_band(name, replace(scene, camera=eye), bands, expected[name])
    walls = {"green": 0.4, "red": 0.45}
    room = replace(
        scene,
        meshes=(box(),),
        materials=(Material("walls", AddSurface(_closure(walls, 0.3), Emission(glow))),),
        instances=(Instance("walls", "box", at(), ("walls",)),),
    )
    inside = np.linalg.solve(identity - _matrix(walls, 0.3), light)
    yield from _by_band("room", room, bands, inside)


def energy_returned(samples: int) -> tuple[float, float]:
    """Share of uniform light that a surface returns, and its standard error; at most 1.

    The surface reflects nothing, and its dye absorbs all light from 380 to 430 nm, at a quantum yield of 1.
    """
    violet = np.where((KNOTS_NM >= 395) & (KNOTS_NM <= 415), 1.0, 0.0)
    grid = SpectralGrid(KNOTS_NM)
    emission = FluorescentDye.gaussian("green", 405, 520).emission
    all_of_it = np.where((KNOTS_NM >= 380) & (KNOTS_NM <= 430), 1.0, 0.0)
    taken = Reflectance("violet", grid, all_of_it * KNOTS_NM / 520.0)
    surface = Fluorescent(Reflectance("black", grid, 0.0 * violet), (FluorescentDye("all", taken, emission),), (0.999,))
    flat = Bands(("power",), np.ones((1, 471)))
    scene = replace(
        empty_scene(Camera(world_from_camera=at(0, 0, 5), kind="orthographic", orthographic_scale=0.01), samples),
        meshes=(square(),),
        materials=(Material("paint", surface),),
        instances=(Instance("tile", "square", at(), ("paint",)),),
        world=World(Illuminant("violet", grid, violet)),
    )
    back, came = in_bands(scene, flat), in_bands(replace(scene, instances=()), flat)
    return float(back.mean() / came.mean()), float(back.std(ddof=1) / np.sqrt(back.size) / came.mean())


def _closure(amounts: dict[str, float], level: float) -> Fluorescent:
    dyes = tuple(FluorescentDye.gaussian(name, *DYES[name], grid=SpectralGrid(KNOTS_NM)) for name in amounts)
    return Fluorescent(Reflectance("paint", SpectralGrid(KNOTS_NM), _reflected(level)), dyes, tuple(amounts.values()))


def _reflected(level: float) -> Array:
    return level + 0.1 * np.sin(KNOTS_NM / 40)


def _matrix(amounts: dict[str, float], level: float) -> Array:
    """Bispectral matrix (n, n) of a surface on the fine grid: radiance out from radiance in."""
    matrix = np.diag(np.interp(FINE_NM, KNOTS_NM, _reflected(level)))
    for name, amount in amounts.items():
        # bells between knots of 5 nm are straight lines
        taken, sent = (
            np.interp(FINE_NM, KNOTS_NM, np.exp(-0.5 * ((KNOTS_NM - center) / BELL_NM) ** 2)) for center in DYES[name]
        )
        matrix += amount * np.outer(sent / (sent.sum() * STEP_NM), taken * STEP_NM)
    return matrix


def _emissive(values: Array) -> Array:
    """Radiance of a light of luminance 1, per nm, on the fine grid."""
    viewer = observer("cie_1931_2deg")
    fine = np.interp(FINE_NM, KNOTS_NM, values)
    luminous = np.interp(FINE_NM, viewer.wavelengths_nm, viewer.cmfs[1], left=0, right=0)
    return np.asarray(fine / float(fine @ luminous * STEP_NM))


def _by_band(name: str, scene: object, bands: Bands, radiance: Array) -> Iterator[Compared]:
    found = in_bands(scene, bands)  # type: ignore[arg-type]
    for band, response, part in zip(bands.names, bands.responses, np.moveaxis(found, -1, 0), strict=True):
        weights = np.interp(FINE_NM, np.arange(360.0, 831.0), response, left=0, right=0)
        yield compared(f"{name}, {float(band):.0f} nm", part, float(weights @ radiance * STEP_NM))
