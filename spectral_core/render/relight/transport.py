# SPDX-License-Identifier: GPL-3.0-or-later
"""A transport render: the contribution of each light group, stored so that the light can be chosen later."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_declared, require_kind, require_text
from spectral_core.errors import InvalidInputError, RenderCancelled, UnknownNameError, counted
from spectral_core.render.light_groups import (
    emits,
    group_text,
    is_black,
    is_of_world,
    light_groups,
    shines,
    world_varies,
)
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.render.relight.agx_view import View
from spectral_core.render.relight.groups import group_light, one_group_per_light, several_colors
from spectral_core.render.relight.memory import require_memory
from spectral_core.render.relight.sampling import sampling_lights
from spectral_core.render.relight.storage import Storage, flat_light
from spectral_core.render.result import RenderResult
from spectral_core.render.still import render_scene
from spectral_core.render.volumes import OWN_LIGHT, shining
from spectral_core.scene import (
    Color,
    Emission,
    Light,
    Material,
    Note,
    Principled,
    ScatteringMedium,
    Scene,
    Surface,
    World,
    gray,
    map_leaves,
    require_scene,
    scene_hash,
)
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Spectrum

Pixels = NDArray[np.float32]


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Transport:
    """Channels per light group. ``channels``: (groups, channels, height, width) float32, row 0 at the bottom.

    ``coverage``: (height, width). ``lights``: the spectrum of each group in the scene, Y = 1 or the luminance of its
    color, None if its lights differ; ``exposure`` is applied when a picture is made. ``scene_hash``: hash of the
    recorded scene.
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
    view: View | None = None
    """View transform of the scene; None for the plain sRGB curve."""
    look: NDArray[np.float64] | None = None
    """(3, 3), by which renders of the scene show linear sRGB: ``Look.picture_matrix``; None if it changes nothing."""
    notes: tuple[Note, ...] = ()
    """Features that the recording approximates; files do not contain them."""

    def __post_init__(self) -> None:
        require_declared(self)
        require_kind("channels of a transport", self.channels, np.ndarray, "of float32")
        require_kind("coverage of a transport", self.coverage, np.ndarray, "of float32")
        expected, given = (len(self.groups), self.storage.channel_count, *self.coverage.shape), self.channels
        if given.shape != expected or given.dtype != np.float32:
            raise InvalidInputError(f"channels are {given.dtype} {given.shape}; expected float32 {expected}")
        if self.look is not None:
            look = frozen_array("the matrix of a look", self.look, (3, 3))
            object.__setattr__(self, "look", None if np.array_equal(look, np.eye(3)) else look)

    def __repr__(self) -> str:
        size = f"{'×'.join(map(str, self.size))} pixels, {counted(self.samples, 'sample')}"
        return f"Transport({self.storage.kind}, {size}, light groups {self.groups})"

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.coverage.shape[1], self.coverage.shape[0]

    def index_of(self, group: str) -> int:
        """Index of a group in ``groups``. Raises UnknownNameError."""
        if group and tuple(self.groups) == ("",):
            raise UnknownNameError(
                f"no light group of this transport is named {group!r}: all lights are in one group without a name; "
                "record one group per light (--one-per-light), or put the lights into light groups"
            )
        if group not in self.groups:
            raise UnknownNameError.among("light group of this transport", group, self.groups)
        return self.groups.index(group)


DYES = (
    "the scene has fluorescent dyes, whose light depends on the lamps at other wavelengths: from bands or Exact their "
    "surfaces would have a wrong color under every lamp; record Mixtures ('dial'), which are right"
)
CLAMPED = (
    "samples are clamped as under the recorded light, so that a render of another mixture may be darker or brighter; "
    "set Clamping (Direct and Indirect Light) to 0 and record again"
)

IN_RGB = (
    "the recording traces wavelengths, a render of this scene red, green and blue, so that saturated colors lit by "
    "colored light differ from those of the render; set Transport to Spectral to render as recorded"
)


def record_transport(
    scene: Scene,
    storage: Storage,
    *,
    one_per_light: bool = False,
    most_groups: int | None = None,
    view: View | None = None,
    look: NDArray[np.float64] | None = None,
    kept: Transport | None = None,
    again: Collection[str] | None = None,
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
    view, look
        How the scene shows linear light, kept with the transport for pages, and the matrix (3, 3) of its look.
    kept, again
        An earlier transport of this scene and the groups that have changed since, see ``groups.changed_groups``: only
        these, and groups that it lacks, are rendered.
    render
        ``render_scene`` or the ``render`` of a ``RenderProcess``.
    options
        Passed on to ``render`` (``on_progress``, ``should_stop``).

    Raises
    ------
    InvalidInputError
        For a scene without light, with too many lights, or a machine without the memory; for fluorescent dyes and a
        storage that keeps spectra; for a ``kept`` transport of another size, storage or number of samples.
    RenderCancelled
        Where it was stopped.
    """
    require_scene(scene)
    require_kind("the storage", storage, Storage, f"relight.storages.storage_named({str(storage)[:20]!r})")
    grouped = one_group_per_light(scene) if one_per_light else scene
    names = light_groups(grouped)
    if not names:
        raise InvalidInputError("the scene has no light, so there is no transport to store; add one")
    if most_groups is not None and len(names) > most_groups:
        raise InvalidInputError(
            f"the scene has {len(names)} light groups, and a dial has up to {most_groups} lights; put some of them "
            "into one light group, or record by Blender's light groups instead of one per light"
        )
    for name in names:
        require_text("the name of a light group", name)
    filters = several_colors(grouped)
    lights = {name: group_light(grouped, name, filters) for name in names}
    if storage.keeps_spectra:
        options.setdefault("sampling_lights", sampling_lights(lights.values(), storage))
    require_memory(storage, scene.film.size, len(names))
    recorded = under_flat_light(grouped) if storage.keeps_spectra else grouped
    if storage.keeps_spectra and plan_from_data(recorded).is_on("fluorescence"):
        raise InvalidInputError(DYES)
    if scene.film.exposure == 0:  # a black picture tells nothing about the light
        recorded = replace(recorded, film=replace(scene.film, exposure=1.0))
    reused = _reused(kept, again, scene, storage)
    wanted = tuple(name for name in names if name not in reused)
    planes: dict[str, Pixels] = {}
    coverage = None if kept is None else kept.coverage
    notes = scene.notes
    own_notes = [Note("Light Paths", CLAMPED)] if scene.settings.light_paths.clamps else []
    if storage.keeps_spectra and not plan_from_data(scene).is_spectral:
        own_notes.append(Note("Transport", IN_RGB))
    own_notes += [Note(name, OWN_LIGHT.format(group_text(names[0]))) for name in shining(scene)]
    if wanted:
        result = render(recorded, groups=wanted if reused else True, bands=storage.measured(), **options)
        if result.status != "done":
            raise RenderCancelled("the transport render was stopped; nothing was stored")
        notes = result.notes
        planes = result.group_band_pixels if storage.keeps_spectra else result.group_pixels
        coverage = np.ascontiguousarray(result.pixels[..., 3])
    names = tuple(name for name in names if name in planes or name in reused)
    if not names or coverage is None:
        raise InvalidInputError("no light of the scene reaches the picture; there is no transport to store")
    # the renderer applies the exposure to pictures, not to bands
    channels = np.empty((len(names), storage.channel_count, *coverage.shape), np.float32)
    _gather(channels, names, planes, reused, 1.0 if storage.keeps_spectra else recorded.film.exposure)
    return Transport(
        storage, names, channels, coverage, tuple(lights[name] for name in names),
        scene.film.exposure, scene_hash(scene), scene.film.samples, scene.film.seed, view, look, (*notes, *own_notes),
    )  # fmt: skip


def _reused(kept: Transport | None, again: Collection[str] | None, scene: Scene, storage: Storage) -> dict[str, Pixels]:
    """Channels (channels, height, width) of the groups of an earlier transport that are still valid."""
    if kept is None or again is None:
        return {}
    film = scene.film
    if (kept.size, kept.samples, kept.seed, kept.storage.channel_names()) != (
        film.size, film.samples, film.seed, storage.channel_names(),
    ):  # fmt: skip
        raise InvalidInputError(
            f"the earlier transport has {kept.size[0]}×{kept.size[1]} pixels, {counted(kept.samples, 'sample')} and "
            f"{kept.storage.kind} storage; record all lights again for another size, quality or storage"
        )
    return {name: planes for name, planes in zip(kept.groups, kept.channels, strict=True) if name not in again}


def _gather(
    channels: Pixels, names: Sequence[str], planes: dict[str, Pixels], reused: Mapping[str, Pixels], exposure: float
) -> None:
    """Fill (groups, channels, height, width). Empties ``planes``: each picture is freed after its copy."""
    for own, name in zip(channels, names, strict=True):
        if name in reused:
            np.copyto(own, reused[name])
        else:
            np.copyto(own, planes.pop(name)[..., : len(own)].transpose(2, 0, 1))
            own /= np.float32(exposure)


def under_flat_light(scene: Scene) -> Scene:
    """The scene with colorless emission of equal power per nm; images and ``several_colors`` keep theirs as filters.

    A spectrum that a group receives later replaces a light's color, as in the scene itself; the sun of a sky keeps its
    color, as the sky does. A black light stays dark
    in a group that has others: these alone determine the group's spectrum.
    """
    lit = {light.group for light in scene.lights if shines(light)}
    lights: tuple[Light, ...] = tuple(
        light
        if is_of_world(light) or (light.group in lit and not shines(light))
        else replace(light, color=_colorless(light.color))
        for light in scene.lights
    )
    filters = several_colors(scene)
    materials = tuple(m if m.name in filters else _colorless_material(m) for m in scene.materials)
    settings = scene.settings.in_spectra(white=flat_light())
    world = scene.world if world_varies(scene) else _colorless_world(scene.world)
    return replace(scene, lights=lights, materials=materials, world=world, settings=settings)


def _colorless(paint: Any) -> Any:
    """A varying emission stays as a filter of the flat light; a constant color or spectrum is removed."""
    return gray(1.0) if isinstance(paint, (Color, Spectrum)) else paint


def _colorless_world(world: World) -> World:
    color = world.color if world.is_black else _colorless(world.color)
    view = None if world.camera_view is None else _colorless_world(world.camera_view)
    return replace(world, color=color, camera_view=view, medium=_colorless_medium(world.medium))


def _colorless_medium(medium: ScatteringMedium | None) -> ScatteringMedium | None:
    if medium is None or not emits(medium):
        return medium
    return replace(medium, emission_color=_colorless(medium.emission_color))


def _colorless_material(material: Material) -> Material:
    surface = None if material.surface is None else _colorless_surface(material.surface)
    return replace(material, surface=surface, medium=_colorless_medium(material.medium))


def _colorless_surface(surface: Surface) -> Surface:
    return map_leaves(surface, _colorless_closure)


def _colorless_closure(closure: Closure) -> Closure:
    if isinstance(closure, Emission) and not is_black(closure.color):
        return replace(closure, color=_colorless(closure.color))
    if isinstance(closure, Principled) and not is_black(closure.emission_color):
        return replace(closure, emission_color=_colorless(closure.emission_color))
    return closure
