# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene under a chosen light: some of its lamps alone, or all of them with another spectrum."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_range
from spectral_core.scene.geometry import Instance
from spectral_core.scene.leaves import map_leaves
from spectral_core.scene.lights import Light, SunLight, World
from spectral_core.scene.motion import following
from spectral_core.scene.paint import Color
from spectral_core.scene.scene import Material, Scene
from spectral_core.scene.surface import Emission, Principled, ScatteringMedium
from spectral_core.spectra.color import RGB_FROM_XYZ, WHITE_XYZ, XYZ_FROM_RGB
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, Spectrum

Array = NDArray[np.float64]

_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
"""Cone responses from XYZ (Lam 1985), as CIECAM97s and ICC profiles use them."""


def shown(picture_matrix: Array, pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear sRGB (height, width, 3 or 4) of a render as a look displays it; the same array if it displays it as it is.

    ``picture_matrix``: that of the look; alpha stays.
    """
    if np.array_equal(picture_matrix, np.eye(3)):
        return pixels
    made = pixels.copy()
    made[..., :3] = pixels[..., :3] @ picture_matrix.T.astype(np.float32)
    return made


_COPY = re.compile(r"( #\d+)+$")
"""What a translation adds to the name of a further light with the same name, as that of an instance."""


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """Light and exposure for a view of a scene.

    ``lamps``: names of the only visible lights, whose copies (``Lamp #2``) are visible, too; None for all.
    ``other_lamps``: names of lights that are none of these, even if they look like the name of a copy.
    ``with_world``: True to keep the world's light, that of the suns in its sky included.
    ``group``: the only visible light group, None for all. ``spectrum``: spectrum of all emission, None for the
    scene's own; tinted lamps and images keep their tint. ``exposure_stops``: brightness of the picture. ``adapts``:
    True if the observer is adapted to ``spectrum``, so that white surfaces look white under it.
    """

    lamps: frozenset[str] | None = None
    group: str | None = None
    spectrum: Spectrum | None = None
    exposure_stops: float = 0.0
    adapts: bool = False
    with_world: bool = False
    other_lamps: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        require_range("exposure of a look", self.exposure_stops, -32.0, 32.0, " stops")

    @property
    def has_light(self) -> bool:
        """True if it changes the light of a scene, and not the exposure of its picture alone."""
        return self.lamps is not None or self.group is not None or self.spectrum is not None

    @property
    def is_plain(self) -> bool:
        """True if the look changes nothing."""
        return not self.has_light and self.exposure_stops == 0

    @property
    def picture_matrix(self) -> Array:
        """(3, 3) from linear sRGB of a picture to that of its display: exposure, and adaptation (Bradford)."""
        factor = 2.0**self.exposure_stops
        if not self.adapts or self.spectrum is None or not np.any(self.spectrum.values):
            return np.eye(3) * factor
        white = xyz_of(normalized(Illuminant("white", self.spectrum.grid, self.spectrum.values)))
        # a spectral line may have a cone response near or below 0, for which no adaptation is defined
        seen, wanted = np.maximum(_BRADFORD @ white, 0.05), _BRADFORD @ WHITE_XYZ
        adapted = np.linalg.inv(_BRADFORD) @ np.diag(wanted / seen) @ _BRADFORD
        return np.asarray(RGB_FROM_XYZ @ adapted @ XYZ_FROM_RGB * factor)

    def on(self, scene: Scene) -> Scene:
        """``scene`` under this look."""
        if self.lamps is not None:
            scene = _alone(scene, self._has, world=self.with_world, emits=lambda _group: False)
        if self.group is not None:
            group = self.group
            world = scene.world.group == group
            scene = _alone(scene, lambda light: light.group == group, world=world, emits=lambda name: name == group)
        return scene if self.spectrum is None else _shining(scene, self.spectrum)

    def _has(self, light: Light) -> bool:
        """True if a light is one of ``lamps``, a copy of one, or a sun of the world that is kept."""
        assert self.lamps is not None
        if light.name in self.lamps or light.name in self.other_lamps:
            return light.name in self.lamps
        if isinstance(light, SunLight) and light.is_of_world:
            return self.with_world
        return _COPY.sub("", light.name) in self.lamps


def _alone(scene: Scene, shines: Any, *, world: bool, emits: Any) -> Scene:
    """The lights of ``shines``, the world if requested, and emissive objects of the groups of ``emits``."""
    found = {material.name: _dark(material) for material in scene.materials}
    dark = {name: made for name, made in found.items() if made is not None}
    names = {material.name for material in scene.materials}
    instances: list[Instance] = []
    used: set[str] = set()
    for instance in scene.instances:
        assigned = instance.materials
        if not emits(instance.group) and dark.keys() & set(assigned):
            assigned = tuple(_dark_name(name, names) if name in dark else name for name in assigned)
            used.update(name for name in instance.materials if name in dark)
        instances.append(instance if assigned is instance.materials else replace(instance, materials=assigned))
    extra = tuple(replace(dark[name], name=_dark_name(name, names)) for name in sorted(used))
    return replace(
        scene,
        lights=tuple(light for light in scene.lights if shines(light)),
        world=scene.world if world else World(medium=_dark_medium(scene.world.medium)),
        instances=tuple(instances),
        materials=(*scene.materials, *extra),
        moments=following(scene.moments, instances),
    )


def _dark_name(name: str, taken: set[str]) -> str:
    wanted = f"{name} (dark)"
    while wanted in taken:
        wanted += "'"
    return wanted


def _dark(material: Material) -> Material | None:
    """The material without its emission; None if it has none."""

    def without(leaf: Any) -> Any:
        if isinstance(leaf, Emission):
            return replace(leaf, strength=0.0)
        if isinstance(leaf, Principled) and leaf.emission_strength != 0:
            return replace(leaf, emission_strength=0.0)
        return leaf

    surface = None if material.surface is None else map_leaves(material.surface, without)
    medium = _dark_medium(material.medium)
    is_same = surface is material.surface and medium is material.medium
    return None if is_same else replace(material, surface=surface, medium=medium)


def _dark_medium(medium: ScatteringMedium | None) -> ScatteringMedium | None:
    """The medium without its emission; the same object if it has none."""
    return medium if medium is None or medium.emission_strength == 0 else replace(medium, emission_strength=0.0)


def _shining(scene: Scene, spectrum: Spectrum) -> Scene:
    """All emission with another spectrum, at unchanged brightness."""
    settings = scene.settings.in_spectra(white=spectrum)
    return replace(
        scene,
        lights=tuple(replace(light, color=_lamp(light, spectrum)) for light in scene.lights),
        world=_world(scene.world, spectrum),
        materials=tuple(_material(material, spectrum) for material in scene.materials),
        settings=settings,
    )


def _lamp(light: Light, spectrum: Spectrum) -> Any:
    """The color of a lamp: a spectrum is replaced, a tinted lamp keeps its tint."""
    return light.color if isinstance(light.color, Color) else spectrum


def _other(paint: Any, spectrum: Spectrum) -> Any:
    """An emission: a spectrum is replaced, colors and images keep their tint."""
    return spectrum if isinstance(paint, Spectrum) else paint


def _world(world: World, spectrum: Spectrum) -> World:
    view = None if world.camera_view is None else _world(world.camera_view, spectrum)
    return replace(world, color=_other(world.color, spectrum), camera_view=view, medium=_medium(world.medium, spectrum))


def _medium(medium: ScatteringMedium | None, spectrum: Spectrum) -> ScatteringMedium | None:
    if medium is None or not isinstance(medium.emission_color, Spectrum):
        return medium
    return replace(medium, emission_color=spectrum)


def _material(material: Material, spectrum: Spectrum) -> Material:
    """The material with the emission of its surface and medium of another spectrum; the same object if it has none."""

    def shining(leaf: Any) -> Any:
        if isinstance(leaf, Emission) and isinstance(leaf.color, Spectrum):
            return replace(leaf, color=spectrum)
        if isinstance(leaf, Principled) and isinstance(leaf.emission_color, Spectrum):
            return replace(leaf, emission_color=spectrum)
        return leaf

    surface = None if material.surface is None else map_leaves(material.surface, shining)
    medium = _medium(material.medium, spectrum)
    is_same = surface is material.surface and medium is material.medium
    return material if is_same else replace(material, surface=surface, medium=medium)
