# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds that vary with direction in more than one image: drawn as an environment, their suns as lights."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from spectral_core.render.same import equal
from spectral_core.scene import Color, Computed, DrawnPattern, Note, SunLight
from spectral_core.scene.camera import space_from_camera
from spectral_core.scene.shading import SENDS_RAYS, Program

from ..camera import translate_film
from ..context import Translation
from ..shading.nodes.textures import is_moved_by_panel
from ..shading.reader import Reader
from ..shading.tree import Input, Output, input_of, linked
from ..shading.walks.shaders import in_order, shader_inputs
from .along_rays import along_rays, color
from .backgrounds import PLAIN_RAYS, Term, directions_of, environment_of, light_paths_of, note_sampled_ray_type
from .directions import Array, Look, shining
from .fineness import MOST_DIFFERENCE, SHARP_DIFFERENCE, difference, everywhere, in_frame

ROWS, MOST_ROWS = 512, 2048
"""Rows of a drawn environment, and of one with images."""
NOISE_SAMPLES, FINE_SAMPLES = 16, 4
"""Directions in each pixel of a drawn environment with white noise, and in each of half as many rows and columns of one
whose pattern is much finer.
"""
R2 = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps of a sequence that fills a square evenly (M. Roberts, 2018)."""


def needs_directions(output: Any) -> bool:
    """True if a world is more than plain colors and environment images, mixed by plain numbers."""
    source = None if output is None else linked(input_of(output, "Surface"))
    return any(_varies(each) for each, _ in in_order(source, shader_inputs))


def _varies(source: Output) -> bool:
    """True if one shader varies by itself."""
    kind = source.node.type
    if kind in ("BACKGROUND", "EMISSION"):
        color = linked(source.input("Color"))
        plain = color is None or _is_plain(color) or _is_placed_image(color)
        return not plain or not _is_number(source.input("Strength")) or _is_negative(source.input("Strength"))
    return kind == "MIX_SHADER" and not _is_number(source.input("Fac") or source.input("Factor"))


PLAIN = ("RGB", "BLACKBODY", "WAVELENGTH", "CUSTOM GROUP")
"""Nodes with a constant color or spectrum."""


def _is_plain(source: Output) -> bool:
    """True for a node with a constant color or spectrum."""
    return source.node.type in PLAIN and not any(
        linked(Input(socket, source.groups)) is not None for socket in source.node.inputs
    )


def _is_negative(place: Input | None) -> bool:
    """True for a strength below zero, which takes light away."""
    end = None if place is None else place.source()
    if isinstance(end, Output):
        return end.node.type == "VALUE" and end.socket.default_value < 0
    return isinstance(end, Input) and isinstance(end.default, float) and end.default < 0


def _is_number(place: Input | None) -> bool:
    source = linked(place)
    return source is None or source.node.type in ("LIGHT_PATH", "VALUE")


def _is_placed_image(source: Output) -> bool:
    """True if a node is an environment image without a mapping, or with a Mapping of plain numbers.

    The filter of a coarse one counts, which Cycles applies to bytes before it decodes them.
    """
    node = source.node
    if node.type != "TEX_ENVIRONMENT" or is_moved_by_panel(node) or node.projection != "EQUIRECTANGULAR":
        return False
    is_coarse = node.image is not None and 0 < node.image.size[1] < ROWS
    if is_coarse and not (node.image.is_float and node.interpolation == "Linear"):
        return False
    before = linked(source.input("Vector"))
    if before is not None and before.node.type == "MAPPING":
        inputs = [Input(socket, before.groups) for socket in before.node.inputs]
        if any(linked(place) is not None for place in inputs[1:]):
            return False
        if not any(before.value("Scale")):
            return False  # no direction is left to look up
        before = linked(inputs[0])
    return before is None or (
        before.node.type == "TEX_COORD" and before.socket.name in ("Generated", "Object") and before.node.object is None
    )


def follows_camera(tree: Any, seen: set[int] | None = None) -> bool:
    """True if nodes of a tree or of its groups use the space or the frame of the camera.

    ``seen``: trees that do not.
    """
    seen = set() if seen is None else seen
    if tree is None or tree.as_pointer() in seen:
        return False
    seen.add(tree.as_pointer())
    for node in tree.nodes:
        if node.type == "CAMERA":
            return True
        if node.type == "VECT_TRANSFORM" and "CAMERA" in (node.convert_from, node.convert_to):
            return True
        if node.type == "TEX_COORD" and any(node.outputs[name].is_linked for name in ("Camera", "Window")):
            return True
        if node.type == "GROUP" and follows_camera(node.node_tree, seen):
            return True
    return False


def world_light(
    translation: Translation, world: Any, output: Any, camera: Any, own: dict[str, Any], *, is_seen: bool = False
) -> WorldLight:
    """The environment for the light in the scene, that for the camera, and the suns of the skies in a world, from its
    ``output`` node. ``is_seen``: True if the camera is that of the picture, whose view of the world is judged, too.
    """
    reader = Reader(translation, world.name, on_surface=True, is_far=True, in_world=True)
    source = linked(input_of(output, "Surface"))
    view = space_from_camera(None) if camera is None else camera.space_from_world
    window = (1.0, 1.0, 0.0, 0.0, 1.0) if camera is None else camera.window(translate_film(translation.scene, 1, 0))
    radiance = shining(reader, input_of(output, "Surface")).program(3)
    heights = [image.pixels.shape[0] for image in reader.builder.images if id(image) not in reader.skies]
    rows = min(max([ROWS, *heights]), MOST_ROWS)
    paths = light_paths_of(source)
    tells = bool(paths)
    asks = replace(Look(view, window=window), asks_rays=True) if paths - PLAIN_RAYS else None
    looks = [Look(view, camera=is_camera, window=window) for is_camera in ((False, True) if tells else (False,))]
    is_shown = is_seen and not translation.scene.render.film_transparent
    framed = in_frame(camera, looks[0]) if is_shown else None
    programs = [along_rays(radiance, look) for look in looks]
    asking = None if asks is None else along_rays(radiance, asks)

    def make() -> WorldLight:
        terms = []
        for look, program in zip(looks, programs, strict=True):
            judged = [everywhere(), *([] if framed is None or (tells and not look.camera) else [framed])]
            terms.append(_drawn(reader, program, rows, judged, None if look.camera else asking))
        if asks is not None and not getattr(terms[0].color, "is_only_met", False):
            for name in sorted(paths - PLAIN_RAYS):
                note_sampled_ray_type(reader, name)
        suns = tuple(
            sun
            for number, image_id in enumerate(reader.skies)
            if (sun := _sun(reader, programs[0], image_id, f"{world.name} sun {number + 1}", own)) is not None
        )
        return terms[0], terms[-1], suns

    skies = [sky[1:] for sky in reader.skies.values()]
    return _kept_or_made(translation, (world.name, programs, asking, sorted(paths), framed, skies, own, rows), make)


WorldLight = tuple[Term, Term, tuple[SunLight, ...]]
_latest: deque[tuple[Any, WorldLight, tuple[Note, ...]]] = deque(maxlen=2)
"""The latest worlds: what each was drawn from, the result and the notes."""


def _kept_or_made(translation: Translation, state: Any, make: Callable[[], WorldLight]) -> WorldLight:
    """The result of ``make``, or that of an earlier translation of an equal world.

    A view translates a world again for each frame and after each undo, the dial for each comparison of its recording
    with the scene; to draw one takes up to a second.
    """
    for before, result, notes in list(_latest):
        if equal(before, state):
            for note in notes:
                translation.note(note.subject, note.message)
            return result
    with translation.listening() as noted:
        result = make()
    _latest.append((state, result, noted.notes))
    return result


def _drawn(reader: Reader, program: Program, rows: int, judged: list[Array], of_rays: Program | None) -> Term:
    """An environment of ``rows`` rows; with its pattern if that differs from it along one of the ``judged`` sets of
    directions, the first of which are everywhere. ``of_rays``: the program of a world that depends on the type of ray.
    """
    operations = {instruction.operation for instruction in program.instructions}
    if of_rays is not None and not SENDS_RAYS & operations:
        return _term(reader.owner, _grid(program, rows, 1), of_rays, tells_rays=True)
    if any(name.startswith("white_noise") for name in operations):
        # every ray meets another value of white noise, so that a pixel of the environment shows a mean
        return _term(reader.owner, _grid(program, rows, NOISE_SAMPLES))
    far = [difference(partial(color, program), along, rows) for along in judged]
    if max(far) <= SHARP_DIFFERENCE:
        return _term(reader.owner, _grid(program, rows, 1))
    if not SENDS_RAYS & operations:
        # single directions of its pixels are not typical of a fine pattern
        found = _grid(program, rows // 2, FINE_SAMPLES) if far[0] > MOST_DIFFERENCE else _grid(program, rows, 1)
        return _term(reader.owner, found, program)
    if max(far) > MOST_DIFFERENCE:
        reader.note(
            f"its pattern is finer than the environment that is drawn from it ({2 * rows} x {rows} pixels): details "
            "are blurred or lost; an Environment Texture of as many pixels as they need shows them"
        )
    return _term(reader.owner, _grid(program, rows, 1))


def _term(name: str, found: Array, program: Program | None = None, *, tells_rays: bool = False) -> Term:
    """An environment of these colors (rows, columns, 3), with its pattern if it has a ``program``."""
    if program is None and found.min() >= 0 and np.ptp(found.reshape(-1, 3), axis=0).max() == 0:
        return Term(Color(found[0, 0]))
    image = environment_of(name, found)
    if program is None:
        return Term(image)
    return Term(DrawnPattern(image.name, image.pixels, "linear", pattern=Computed(program), tells_rays=tells_rays))


def _grid(program: Program, rows: int, samples: int) -> Array:
    """Mean colors (rows, 2 rows, 3) of a number of directions in each pixel of an environment."""
    places = [tuple((0.5 + k * R2) % 1.0) for k in range(samples)]
    found = sum(color(program, directions_of(rows, at).reshape(-1, 3)) for at in places)
    return np.asarray(found / samples).reshape(rows, 2 * rows, 3)


def _sun(reader: Reader, program: Program, image_id: int, name: str, own: dict[str, Any]) -> SunLight | None:
    """The disk of a sky's sun as a light, after the following nodes; None if it is invisible."""
    image, atmosphere, angle, intensity = reader.skies[image_id]
    if angle <= 0 or intensity <= 0:
        return None
    toward = atmosphere.toward_sun
    disk = atmosphere.sun_radiance(angle) * intensity + atmosphere.radiance(toward)
    swapped = replace(image, pixels=disk.astype(np.float32)[None, None])
    lit = Program(tuple(replace(i, data=swapped) if id(i.data) == image_id else i for i in program.instructions))
    added = color(lit, toward[None])[0] - color(program, toward[None])[0]
    size = float(added.max())
    if size <= 0:
        return None
    axis = np.cross((0.0, 0.0, 1.0) if abs(toward[2]) < 0.9 else (1.0, 0.0, 0.0), toward)
    axis /= np.linalg.norm(axis)
    turned = np.eye(4)
    turned[:3, :3] = np.stack([axis, np.cross(toward, axis), toward], axis=1)
    return SunLight(
        name=name,
        world_from_light=turned,
        color=Color(np.maximum(added, 0.0) / size),
        irradiance=size * float(np.pi * np.sin(angle / 2) ** 2),
        angle_rad=angle,
        camera_visible=True,
        is_of_world=True,
        **own,
    )
