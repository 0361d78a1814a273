# SPDX-License-Identifier: GPL-3.0-or-later
"""A transport render: what each light group contributes, stored so that light can be decided later."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, RenderCancelled, UnknownNameError
from spectral_core.render.mitsuba_scene.paint import emitted_spectrum, white_light
from spectral_core.render.relight.memory import require_memory
from spectral_core.render.relight.storage import Storage, flat_light
from spectral_core.render.relight.view_transform import ViewTransform
from spectral_core.render.still import RenderResult, render_scene
from spectral_core.scene import (
    Color,
    Emission,
    Light,
    Material,
    Principled,
    Scene,
    Surface,
    gray,
    leaves,
    map_leaves,
    scene_hash,
)
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Spectrum

Pixels = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Transport:
    """Channels per light group. ``channels``: (groups, channels, height, width) float32, row 0 at the bottom.

    ``coverage``: (height, width). ``lights``: the spectrum that each group had in the scene, Y = 1 or the luminance of
    its color, None where its lights differ; ``exposure`` is applied when a picture is made. ``scene_hash``: of the
    scene it was made from.
    """

    storage: Storage
    groups: tuple[str, ...]
    channels: Pixels
    coverage: Pixels
    lights: tuple[Spectrum | None, ...]
    exposure: float
    scene_hash: str
    samples: int
    seed: int
    view: ViewTransform | None = None
    """How the scene shows linear light on a screen; None for the plain sRGB curve."""

    def __post_init__(self) -> None:
        expected = (len(self.groups), self.storage.channel_count, *self.coverage.shape)
        if self.channels.shape != expected or self.channels.dtype != np.float32:
            raise InvalidInputError(
                f"transport channels are {self.channels.dtype} of shape {self.channels.shape}; "
                f"expected float32 of shape {expected}"
            )

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.coverage.shape[1], self.coverage.shape[0]

    def index_of(self, group: str) -> int:
        """Place of a group among ``groups``. Raises UnknownNameError."""
        if group not in self.groups:
            raise UnknownNameError.among("light group of this transport", group, self.groups)
        return self.groups.index(group)


SAMPLING_LIGHTS: tuple[Spectrum, ...] = (flat_light(),)
"""Wavelengths of a transport render are drawn for any light to come. A render with these ``sampling_lights`` and the
same seed traces the very same paths, so that a relit picture equals it to float rounding."""


def record_transport(
    scene: Scene,
    storage: Storage,
    *,
    one_per_light: bool = False,
    most_groups: int | None = None,
    view: ViewTransform | None = None,
    render: Callable[..., RenderResult] = render_scene,
    **options: Any,
) -> Transport:
    """Render each light group of ``scene`` by itself, under its own light (``dial``) or under flat light.

    Parameters
    ----------
    scene, storage
        What is rendered, and what is kept of it.
    one_per_light
        Every light becomes a group of its own name.
    most_groups
        Refuse a scene with more light groups before anything is rendered; a dial has up to ``dial.MOST_BULBS``.
    view
        How the scene shows linear light, kept with the transport for pages.
    render
        ``render_scene`` or the ``render`` of a ``RenderProcess``.
    options
        Passed on to ``render`` (``on_progress``, ``should_stop``).

    Raises
    ------
    InvalidInputError
        For a scene without light, with too many lights, or a machine without the memory.
    RenderCancelled
        Where it was stopped.
    """
    grouped = one_group_per_light(scene) if one_per_light else scene
    names = light_groups(grouped)
    if not names:
        raise InvalidInputError("the scene has no light, so there is no transport to store; add one")
    if most_groups is not None and len(names) > most_groups:
        raise InvalidInputError(
            f"the scene has {len(names)} light groups, and a dial has up to {most_groups} lights; put some of them "
            "into one light group, or record by Blender's light groups instead of one per light"
        )
    if storage.keeps_spectra:
        options.setdefault("sampling_lights", SAMPLING_LIGHTS)
    require_memory(storage, scene.film.size, len(names))
    recorded = under_flat_light(grouped) if storage.keeps_spectra else grouped
    result = render(recorded, groups=True, bands=storage.measured(), **options)
    if result.status != "done":
        raise RenderCancelled("the transport render was stopped; nothing was stored")
    planes = result.group_band_pixels if storage.keeps_spectra else result.group_pixels
    names = tuple(name for name in planes)
    if not names:
        raise InvalidInputError("no light of the scene reaches the picture; there is no transport to store")
    channels = _gathered(planes, storage.channel_count)
    exposure = scene.film.exposure
    if not storage.keeps_spectra:
        channels /= np.float32(exposure)  # the renderer exposes pictures, not bands
    return Transport(
        storage, names, channels, np.ascontiguousarray(result.pixels[..., 3]),
        tuple(_group_light(grouped, name) for name in names), exposure, scene_hash(scene), result.samples,
        scene.film.seed, view,
    )  # fmt: skip


def _gathered(planes: dict[str, Pixels], count: int) -> Pixels:
    """(groups, channels, height, width) of pictures by group. Empties ``planes``: each is let go once it is copied."""
    height, width = next(iter(planes.values())).shape[:2]
    channels = np.empty((len(planes), count, height, width), np.float32)
    for number, name in enumerate(tuple(planes)):
        np.copyto(channels[number], planes.pop(name)[..., :count].transpose(2, 0, 1))
    return channels


def light_groups(scene: Scene) -> tuple[str, ...]:
    """Names of the light groups of everything that shines, sorted."""
    names = {light.group for light in scene.lights}
    if not scene.world.is_black:
        names.add(scene.world.group)
    glowing = _glowing_materials(scene)
    names |= {instance.group for instance in scene.instances if glowing.intersection(instance.materials)}
    return tuple(sorted(names))


def one_group_per_light(scene: Scene) -> Scene:
    """The scene with every light, glowing object and the surroundings in a group of its own name.

    Things of one name stay apart: the second gets a number, as Blender gives it (``Lamp.001``).
    """
    taken: set[str] = set()

    def own(name: str) -> str:
        numbered = (f"{name}.{number:03d}" for number in count(1))
        free = name if name not in taken else next(other for other in numbered if other not in taken)
        taken.add(free)
        return free

    lights = tuple(replace(light, group=own(light.name)) for light in scene.lights)
    glowing = _glowing_materials(scene)
    instances = tuple(
        replace(thing, group=own(thing.name) if glowing.intersection(thing.materials) else thing.name)
        for thing in scene.instances
    )
    return replace(
        scene,
        lights=lights,
        instances=instances,
        world=replace(scene.world, group=own(scene.world.group or "World")),
    )


def under_flat_light(scene: Scene) -> Scene:
    """The scene with every emission colorless and of equal power per nm; images keep their colors as filters.

    A spectrum given to a group later takes the place of a light's color, as it does in the scene itself.
    """
    lights: tuple[Light, ...] = tuple(replace(light, color=_colorless(light.color)) for light in scene.lights)
    materials = tuple(
        m if m.surface is None else replace(m, surface=_colorless_surface(m.surface)) for m in scene.materials
    )
    settings = replace(scene.settings, transport="spectral", white=flat_light())
    world = scene.world if scene.world.is_black else replace(scene.world, color=_colorless(scene.world.color))
    return replace(scene, lights=lights, materials=materials, world=world, settings=settings)


def under_lights(scene: Scene, spectra: Mapping[str, Spectrum]) -> Scene:
    """The scene with the lights of each named group with that spectrum: what a relit picture is compared with."""

    def lit(item: Any) -> Any:
        return replace(item, color=spectra[item.group]) if item.group in spectra else item

    return replace(scene, lights=tuple(lit(light) for light in scene.lights), world=lit(scene.world))


def _colorless(paint: Any) -> Any:
    """What varies from place to place stays, as a filter of the flat light; one color or spectrum is left out."""
    return gray(1.0) if isinstance(paint, (Color, Spectrum)) else paint


def _colorless_surface(surface: Surface) -> Surface:
    return map_leaves(surface, _colorless_closure)


def _colorless_closure(closure: Closure) -> Closure:
    if isinstance(closure, Emission):
        return replace(closure, color=_colorless(closure.color))
    if isinstance(closure, Principled):
        return replace(closure, emission_color=_colorless(closure.emission_color))
    return closure


def _group_light(scene: Scene, group: str) -> Spectrum | None:
    """The one spectrum that everything of a group shines with, as bright as its color; None where they differ."""
    paints: list[Any] = [light.color for light in scene.lights if light.group == group]
    if scene.world.group == group and not scene.world.is_black:
        paints.append(scene.world.color)
    paints += _glowing_paints(scene, group)
    # what varies from place to place was recorded as a filter of the light: by itself it tints white
    spectra = [emitted_spectrum(p) if isinstance(p, (Color, Spectrum)) else white_light() for p in paints]
    if not spectra:
        return None
    first = spectra[0]
    same = all(s.grid.same_as(first.grid) and np.allclose(s.values, first.values) for s in spectra[1:])
    return first if same else None


def _glowing_materials(scene: Scene) -> set[str]:
    return {material.name for material in scene.materials if _emitted(material)}


def _glowing_paints(scene: Scene, group: str) -> list[Any]:
    """What the glowing objects of a group shine with."""
    assigned = {name for instance in scene.instances if instance.group == group for name in instance.materials}
    return [paint for material in scene.materials if material.name in assigned for paint in _emitted(material)]


def _emitted(material: Material) -> list[Any]:
    found: list[Any] = []
    for closure in leaves(material.surface):
        if isinstance(closure, Emission):
            found.append(closure.color)
        if isinstance(closure, Principled) and closure.emission_strength != 0:
            found.append(closure.emission_color)
    return found
