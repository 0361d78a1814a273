# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the whole Mitsuba scene: meshes with their materials, lights, environment, and notes on approximations."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lens.camera_rays import is_singular
from spectral_core.render.lights.emission import Emission
from spectral_core.render.lights.listing import LightList
from spectral_core.render.lights.scene_lights import SceneLights
from spectral_core.render.mitsuba_scene import light
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.fluorescent import has_dyes
from spectral_core.render.mitsuba_scene.kept import keep
from spectral_core.render.mitsuba_scene.lamps.rows import add_lamp, add_world
from spectral_core.render.mitsuba_scene.lamps.weights import chosen_emitters
from spectral_core.render.mitsuba_scene.media.around import media_at, meets_some, overlapping_media, ray_starts
from spectral_core.render.mitsuba_scene.media.rows import clear_row
from spectral_core.render.mitsuba_scene.paint import sampled_spectrum, unit_luminance
from spectral_core.render.mitsuba_scene.rules import HOLDOUT, MOST_LINKED_LIGHTS, STRAND, RayRules
from spectral_core.render.mitsuba_scene.shapes import Shapes
from spectral_core.render.mitsuba_scene.surface import leaves_of
from spectral_core.render.plugins.paints.tables import SceneTables
from spectral_core.render.trace.media.table import FARTHEST, MediaAround
from spectral_core.scene import Camera, Color, Film, Light, Note, Rays, Scene, World
from spectral_core.scene.geometry import corners_of, index_box, placed, placed_boxes, placed_by_mesh, unit_box

SMALLEST_SCENE, LARGEST_SCENE = 1e-9, 1e8
"""Radii of scenes that 32-bit numbers represent well; smaller and larger scenes get a note."""
LAMP_BODY = "\0lamp"
"""Name of the material of Mitsuba's lamps, which is transparent. No material of an artist has this name."""
CROWDED = "is where more than two volumes overlap; a ray knows two of them at a time, beside that of the world"
UNLIMITED_BOUNCES = 1024
"""Blender's largest number of bounces, which means no limit."""


@dataclass(frozen=True, slots=True, eq=False)
class SceneParts:
    """Mitsuba's objects by their names in the scene, so that single ones can be edited.

    ``placed``: shapes or instances by instance name. ``lights``: by light name. ``world``: the environment's emitter.
    """

    context: Context
    shapes: Shapes
    placed: dict[str, list[Any]]
    lights: dict[str, list[light.LightObject]]
    world: Any | None


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class LoadedScene:
    """``scene``: Mitsuba's scene; ``notes``: features that are approximated.

    ``switches``: functions that turn a light group on and off, if groups were requested. ``rules``: visibility of
    shapes and lights to rays, and media. ``parts``: objects by name. ``background``: the emitter that the camera sees
    behind everything, None for black.
    """

    scene: Any
    notes: tuple[Note, ...]
    switches: dict[str, list[Callable[[bool], None]]]
    rules: RayRules
    parts: SceneParts
    background: Any | None = None
    lights: Any | None = None
    """``SceneLights`` of our path integrator; None if lamps are Mitsuba's emitters."""
    chosen: Any | None = None
    """``ChosenEmitters`` of a scene that can be edited; None if each emitter has the same probability."""

    def light_only(self, group: str) -> None:
        """Switch off every light group except one."""
        for name, switches in self.switches.items():
            for switch in switches:
                switch(name == group)


def load_scene(
    scene: Scene,
    mitsuba: Any,
    *,
    spectral: bool,
    groups: bool = False,
    movable: bool = False,
    own_lights: bool = False,
    even: bool = False,
) -> LoadedScene:
    """Mitsuba's scene of ``scene`` under the active variant.

    ``groups``: make light groups switchable. ``movable``: let objects move without rebuilding the tree of all
    triangles. ``own_lights``: store lamps and emissive meshes in the tables of ``render.lights`` for our path
    integrator, instead of Mitsuba's emitters. ``even``: draw lights without regard to their brightness.
    """
    white = scene.settings.white
    unit_white = None if white is None else unit_luminance(white)
    context = Context(mitsuba, spectral, {} if groups else None, white=unit_white, movable=movable)
    context.has_dyes = spectral and has_dyes(scene)
    context.filter_glossy = scene.settings.light_paths.filter_glossy
    context.lights = LightList(even=even) if own_lights else None
    description: dict[str, Any] = {"type": "scene"}
    look_through(context.tables, scene.camera, scene.film)
    bits = _link_bits(context, scene)
    shapes = Shapes(context, scene, bits)
    parts = shapes.geometry.parts
    placements, lamps, rules = dict[str, list[Any]](), dict[str, list[light.LightObject]](), RayRules()
    for number, there in _place(scene, shapes, rules, bits):
        placements[scene.instances[number].name] = there
        for shape_number, shape in enumerate(there):
            description[f"shape_{number:06d}_{shape_number:03d}"] = shape
    for number, group in enumerate(shapes.groups):  # a Mitsuba scene must contain the shape groups of its instances
        description[f"group_{number:06d}"] = group
    sphere = bounding_sphere(scene, {name: [part.positions for part in of.values()] for name, of in parts.items()})
    for number, item in enumerate(scene.lights):
        if context.lights is not None:
            source = add_lamp(context, context.lights, item)
            if source is not None:
                _light_rules(rules, item, source + 1, bits.get(item.name, 0))
            continue
        lamps[item.name] = light.light_objects(context, item, sphere)
        for object_number, made in enumerate(lamps[item.name]):
            description[f"light_{number:06d}_{object_number}"] = made.entry
            _light_rules(rules, item, made.emitter, bits.get(item.name, 0))
            if isinstance(made.entry, mitsuba.Shape):
                _enter_body(context, made.entry)
                if not item.camera_visible:
                    rules.add_shapes([made.entry], int(Rays.CAMERA))
    geometry = shapes.geometry
    world = geometry.world = geometry.world or light.world_emitter(context, scene.world)
    if world is not None:
        description["world"] = world
        key = world if context.lights is None else add_world(context, context.lights, scene.world, world) + 1
        _light_rules(rules, scene.world, key, 0)
    background = None if scene.world.hidden_from & Rays.CAMERA else world
    if scene.world.camera_view is not None:
        view = replace(scene.world.camera_view, group=scene.world.group)
        black = replace(view, color=Color(np.full(3, 1e-30)), strength=1.0)
        background = rules.camera_world = light.world_emitter(context, black if view.is_black else view)
    context.bsdf.seal()
    if geometry.scene is None:
        context.meshes.seal()
    rules.surfaces, rules.meshes = context.bsdf.surfaces, context.meshes
    loaded = geometry.scene or context.load(description)
    _fill(rules, bits, shapes, scene, loaded)
    lights = None if context.lights is None else _scene_lights(context, context.lights, loaded, rules)
    by_name = SceneParts(context, shapes, placements, lamps, world)
    switches = context.switches or {}
    rules.subsurface, rules.disks, rules.holdouts = context.has_subsurface, context.has_disks, context.has_holdouts
    chosen = chosen_emitters(context, loaded, scene, by_name, rules) if movable and not scene.volumes else None
    home = LoadedScene(loaded, tuple(context.notes), switches, rules, by_name, background, lights, chosen)
    context.tables.live_in(home)
    keep(context, geometry, loaded)
    return home


def _place(scene: Scene, shapes: Shapes, rules: RayRules, bits: dict[str, int]) -> Iterator[tuple[int, list[Any]]]:
    """The shapes of each instance by its number; registers its visibility and linking."""
    strands = {mesh.name for mesh in scene.meshes if mesh.is_strands}
    for number, instance in enumerate(scene.instances):
        placed = shapes.of(number, instance)
        hidden_bits = (
            int(instance.hidden_from)
            | (HOLDOUT if instance.is_holdout else 0)
            | (STRAND if instance.mesh in strands else 0)
        )
        clear = sum({bits.get(name, 0) for name in instance.clear_for})
        rules.add_shapes(placed, hidden_bits, shapes.unlit_by(instance), clear)
        yield number, placed


def _fill(rules: RayRules, bits: dict[str, int], shapes: Shapes, scene: Scene, loaded: Any) -> None:
    """Register the rules of emissive objects, and the media of shapes, of the world and at the camera."""
    for source, instance in shapes.emissive:  # rays that pass through the object do not take its light either
        hidden = instance.hidden_from & ~(Rays.CAMERA | Rays.SHADOW)
        if instance.is_holdout:
            hidden |= Rays.CAMERA
        if hidden:
            rules.lights.append((source, int(hidden)))
        if instance.name in bits:
            rules.links.append((source, bits[instance.name].bit_length() - 1))
    around = shapes.fill(scene.world.medium, "World", scene.world.group)
    if not shapes.media and shapes.has_clear_borders:  # without any medium these would be opaque
        shapes.media.append(clear_row(shapes.context))
    rules.media, rules.inside, rules.unlit_media = shapes.media, shapes.inside, shapes.unlit_media
    if rules.media:
        movable = shapes.context.movable
        eye, apart = scene.camera.world_from_camera[:3, 3], None
        if not (movable or is_singular(scene.camera)):  # a live view has another camera
            eye, low, high = ray_starts(scene.camera, scene.film)
            apart = (float(eye[0]), float(eye[1]), float(eye[2])) if meets_some(rules.inside, low, high) else None
        camera = media_at(shapes.context.mitsuba, loaded, rules.inside, eye, around)
        overlap, crowded = overlapping_media(scene)
        for name in crowded:
            shapes.context.note(name, CROWDED)
        # objects of a live view may be moved into each other
        rules.around = MediaAround(around, camera, overlap or (movable and len(shapes.inside) > 1), apart)


def _enter_body(context: Context, body: Any) -> None:
    """Register the body of one of Mitsuba's lamps in our tables."""
    if not context.bsdf.surfaces.has(LAMP_BODY):
        context.bsdf.surfaces.add(LAMP_BODY, leaves_of(context, None, ""))
    context.bsdf.surfaces.assign(body, LAMP_BODY)
    context.tables.has_bodies = True
    context.meshes.add(body)


def _scene_lights(context: Context, lights: LightList, loaded: Any, rules: RayRules) -> SceneLights:
    """Tables of all lights of a loaded scene."""
    box, fogged = loaded.bbox(), rules.around.world != 0  # a medium of the world attenuates distant light
    reach = FARTHEST if fogged else 1e3
    if box.valid() and not fogged:
        reach = 4 * float(np.linalg.norm(np.array(box.max) - np.array(box.min))) + 1e-3
    texture_of = partial(sampled_spectrum, context)
    emission = Emission(context.mitsuba, lights, spectral=context.spectral, texture_of=texture_of)
    return SceneLights(context.mitsuba, lights, reach, emission, rules)


def _link_bits(context: Context, scene: Scene) -> dict[str, int]:
    """A bit for each light that does not illuminate some object, or casts no shadow for it."""
    linked = dict.fromkeys(name for item in scene.instances for name in (*item.unlit_by, *item.clear_for))
    for name in list(linked)[MOST_LINKED_LIGHTS:]:
        context.note(name, f"is linked to objects as more than {MOST_LINKED_LIGHTS} lights are; it lights everything")
    return {name: 1 << number for number, name in enumerate(list(linked)[:MOST_LINKED_LIGHTS])}


def _light_rules(rules: RayRules, item: Light | World, emitter: Any, bit: int) -> None:
    """Register the exceptions of a light."""
    if item.hidden_from:
        rules.lights.append((emitter, int(item.hidden_from)))
    if item.max_bounces < UNLIMITED_BOUNCES:
        rules.light_bounces.append((emitter, item.max_bounces))
    if bit:
        rules.links.append((emitter, bit.bit_length() - 1))
    if not isinstance(item, World) and not item.casts_shadow:
        rules.shadowless.append(emitter)
    if not isinstance(item, World) and not item.is_met:
        rules.only_sampled.append(emitter)


def look_through(tables: SceneTables, camera: Camera, film: Film) -> None:
    """Set the camera that shading programs read."""
    window = camera.window(film)
    tables.look_from(camera.space_from_world, window, window[0] / film.width)


def size_note(radius: float) -> tuple[Note, ...]:
    """A note on scenes that are too small or too large for 32-bit numbers in any unit; an empty one has radius 0."""
    if radius == 0 or SMALLEST_SCENE <= radius <= LARGEST_SCENE:
        return ()
    text = f"it is {2 * radius:.2g} units across, where 32-bit numbers cannot separate near surfaces; scale it"
    return (Note("Scene", text),)


def scene_radius(scene: Scene) -> float:
    """Radius of the sphere around all placed objects and the camera."""
    return bounding_sphere(scene)[1]


def bounding_sphere(
    scene: Scene, positions: Mapping[str, Iterable[NDArray[np.float32]]] | None = None
) -> tuple[NDArray[np.float64], float]:
    """Center and radius around every placed mesh (its positions by name, by default all), volume and the camera."""
    points = [scene.camera.world_from_camera[None, :3, 3]]
    if positions is None:
        points += placed_boxes(scene.meshes, scene.instances)
    else:
        boxes = {name: [corners_of(part) for part in parts] for name, parts in positions.items()}
        for name, (_, matrices) in placed_by_mesh(scene.instances).items():
            for corners in boxes.get(name, ()):
                points.append(placed(corners, matrices).reshape(-1, 3))
    for volume in scene.volumes:
        points.append(placed(unit_box().positions, volume.world_from_index @ index_box(volume.data.shape)))
    everything = np.concatenate(points)
    low, high = everything.min(axis=0), everything.max(axis=0)
    return (low + high) / 2, float(np.linalg.norm(high - low)) / 2
