# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes with an analytic answer: each returns pairs of a rendered and a computed value.

The formulas are complete here and share no code with the renderer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.render.cases.meshes import at, box, square
from benchmarks.render.checks.furnace_scenes import traced
from spectral_core.render.job import Measure, RenderJob
from spectral_core.render.plan.effects import plan_effects
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import (
    Camera,
    Diffuse,
    Film,
    Glass,
    ImageTexture,
    Instance,
    Material,
    Mesh,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    Scene,
    World,
    gray,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum


@dataclass(frozen=True)
class Compared:
    """One number: ``measured`` by a render, ``expected`` from the formula."""

    case: str
    measured: float
    expected: float
    noise: float
    """Standard error of the measured value, from its pixels."""

    @property
    def error(self) -> float:
        """Difference relative to the expected value."""
        return abs(self.measured - self.expected) / self.expected

    @property
    def agrees(self) -> bool:
        """True if the two differ by at most 0.5 % or within the noise."""
        return self.error <= 0.005 or abs(self.measured - self.expected) <= 4.5 * self.noise


def slab(samples: int, transport: str) -> Iterator[Compared]:
    """Light through and off a plane sheet of glass, with everything that is reflected inside of it.

    Each face reflects F = (Fs + Fp) / 2 of light that has no polarization; all orders add up to
    T = (1 - F) / (1 + F), R = 2F / (1 + F).
    """
    for index in (1.1, 1.5, 2.4):
        for degrees in (0.0, 30.0, 60.0, 80.0):
            sine = np.sin(np.radians(degrees))
            outside, inside = np.cos(np.radians(degrees)), np.sqrt(1 - (sine / index) ** 2)
            across = (outside - index * inside) / (outside + index * inside)
            along = (index * outside - inside) / (index * outside + inside)
            face = (across**2 + along**2) / 2
            expected = {"through": (1 - face) / (1 + face), "off": 2 * face / (1 + face)}
            for way, lit in (("through", (0, 8)), ("off", (8, 180))):
                sheet = at(scale=(500.0, 500.0, 0.5), turn=("x", degrees))
                scene = _through(sheet, Glass(gray(1.0), 0.0, index), samples, transport, polar(*lit))
                yield compared(f"n {index} at {degrees:.0f}°, {way}", traced(scene)[0].mean(axis=-1), expected[way])


def true_slab(index: float, degrees: float) -> float:
    """Transmittance of a sheet for unpolarized light if each polarization is followed separately."""
    inside = np.arcsin(np.sin(np.radians(degrees)) / index)
    outside = np.radians(degrees)
    across = (np.sin(outside - inside) / np.sin(outside + inside)) ** 2
    along = (np.tan(outside - inside) / np.tan(outside + inside)) ** 2
    return float(np.mean([(1 - f) / (1 + f) for f in (across, along)]))


def absorption(samples: int) -> Iterator[Compared]:
    """Beer and Lambert, per wavelength: exp(-σ(λ) d) of the light passes a slab that only absorbs."""
    grid = SpectralGrid.uniform(360, 830, 10)
    absorbing = Spectrum("absorption", grid, 0.05 + 1.5 * np.exp(-(((grid.wavelengths_nm - 560) / 60) ** 2)))
    bands, daylight = Bands.uniform(420, 680, 14), catalogue.illuminant("D65")
    for thickness in (0.5, 2.0):
        for glass in (False, True):
            surface = Glass(gray(1.0), 0.0, 1.5) if glass else None
            placed = at(scale=(500.0, 500.0, thickness / 2))
            scene = _through(placed, surface, samples, "spectral", polar(0, 20))
            dull = Material("sheet", surface, ScatteringMedium(1.0, gray(0.0), absorbing))
            bright = in_bands(replace(scene, instances=()), bands).mean(axis=(0, 1))
            found = in_bands(replace(scene, materials=(dull,)), bands) / bright
            for name, ratio in zip(bands.names, np.moveaxis(found, -1, 0), strict=True):
                fine = float(name) + np.linspace(-20, 20, 401)
                passed = np.exp(-np.interp(fine, grid.wavelengths_nm, absorbing.values) * thickness)
                if glass:
                    face = 0.04  # ((1.5 - 1) / (1.5 + 1))²
                    passed = (1 - face) ** 2 * passed / (1 - (face * passed) ** 2)
                # the environment has the spectrum of daylight, which is not even within a band
                response = (1 - np.abs(np.linspace(-1, 1, 401))) * daylight.at(fine)
                what = "glass" if glass else "fog"
                case = f"{what}, {thickness} thick, {float(name):.0f} nm"
                yield compared(case, ratio, float(np.average(passed, weights=response)))


def prism(samples: int) -> Iterator[Compared]:
    """Snell's law at both faces of a dispersive prism: direction of light of each wavelength, in degrees.

    The brightness of the environment is proportional to the angle from the view, so brightness measures the angle.
    """
    grid = SpectralGrid.uniform(360, 830, 5)
    index = 1.45 + 1.2e4 / grid.wavelengths_nm**2  # Cauchy, of the dispersion of a flint glass
    apex, bands = 30.0, Bands.uniform(420, 680, 14)
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32) * 50
    fan = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    # two faces are the whole prism for paths of two bounces: the upper level, the lower turned by the apex angle
    faces = (Mesh("face", corners, fan),)
    glass = (Material("sheet", Glass(gray(1.0), 0.0, Spectrum("glass", grid, index))),)
    lower = at(0, 0, -40, turn=("x", apex)) @ np.diag([1.0, -1.0, -1.0, 1.0])
    placed = (
        Instance("upper", "face", np.eye(4), ("sheet",)),
        Instance("lower", "face", lower, ("sheet",)),
    )
    most = 40.0
    pictures = []
    for ramp in (True, False):
        base = _through(np.eye(4), Glass(), samples, "spectral", polar(0, most, ramp=ramp))
        scene = replace(base, meshes=faces, materials=glass, instances=placed)
        pictures.append(in_bands(replace(scene, settings=RenderSettings("spectral", 2)), bands))
    for name, part in zip(bands.names, np.moveaxis(pictures[0] / pictures[1], -1, 0), strict=True):
        n = np.interp(float(name), grid.wavelengths_nm, index)
        leaving = np.arcsin(n * np.sin(np.radians(apex)))  # the upper face is met straight on
        yield compared(f"{float(name):.0f} nm, degrees", part * most, float(np.degrees(leaving) - apex))


def lamps(samples: int, transport: str) -> Iterator[Compared]:
    """A point and a ball over a plane: E = I cos θ / d², I = power / 4π, for the ball as well while all of it is up."""
    height, power, reflectance = 2.0, 100.0, 0.5
    for radius, name in ((0.0, "point"), (0.5, "ball"), (1.5, "large ball")):
        for away in (0.0, 1.0, 3.0, 10.0):
            lamp = PointLight(
                name="lamp", world_from_light=at(0, 0, height), power_w=power, radius=radius, soft_falloff=False
            )
            eye = at(away, 0, 3.0 if away else 0.3)  # not in the ball
            scene = empty_scene(Camera(world_from_camera=eye, field_of_view_rad=1e-3, near=1e-3), samples, transport)
            scene = replace(
                scene,
                meshes=(square(),),
                materials=(Material("paper", Diffuse(gray(reflectance))),),
                instances=(Instance("table", "square", at(scale=(100.0, 100.0, 1.0)), ("paper",)),),
                lights=(lamp,),
            )
            distance = np.hypot(height, away)
            expected = reflectance / np.pi * power / (4 * np.pi) * (height / distance) / distance**2
            yield compared(f"{name}, {away:g} aside", traced(scene)[0].mean(axis=-1), float(expected))


def _through(placed: Any, surface: Any, samples: int, transport: str, world: Any) -> Scene:
    """A box below a camera that looks straight down, in an environment."""
    eye = Camera(world_from_camera=at(0, 0, 60), kind="orthographic", orthographic_scale=0.01)
    return replace(
        empty_scene(eye, samples, transport),
        meshes=(box(),),
        materials=(Material("sheet", surface),),
        instances=(Instance("sheet", "box", placed, ("sheet",)),),
        world=World(world),
    )


def empty_scene(camera: Camera, samples: int, transport: str = "spectral") -> Scene:
    """Nothing before a camera, on a small film; paths of many bounces."""
    return Scene(
        camera=camera,
        film=Film(8, 8, samples, filter_kind="box", filter_width=1.0),
        settings=RenderSettings(transport=transport, max_bounces=128),  # type: ignore[arg-type]
    )


def polar(first: float, last: float, *, ramp: bool = False) -> ImageTexture:
    """A world that is white from ``first`` to ``last`` degrees about the downward direction, or rises to 1 there."""
    rows = 1440
    degrees = (np.arange(rows) + 0.5) * 180 / rows  # row 0 is straight down
    value = np.where((degrees >= first) & (degrees <= last), degrees / last if ramp else 1.0, 0.0)
    pixels = np.repeat(value[:, None, None], 4, axis=1).repeat(3, axis=2).astype(np.float32)
    return ImageTexture("surroundings", pixels, "linear")


def in_bands(scene: Scene, bands: Bands) -> Any:
    """Spectral channels (height, width, n_bands) of a render."""
    job = RenderJob(scene, plan_effects(scene, pilot=False), Measure(bands))
    job.trace(scene.film.samples)
    return job.band_picture().astype(np.float64)


def compared(case: str, pixels: Any, expected: float) -> Compared:
    """The mean of pixels, and its expected value."""
    return Compared(case, float(pixels.mean()), expected, float(pixels.std(ddof=1) / np.sqrt(pixels.size)))
