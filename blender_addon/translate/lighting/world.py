# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's world as the environment of the scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Color, ImageTexture, MixedPaint, Paint, Rays, SunLight, World, gray
from spectral_core.spectra.catalogue import PLANCK
from spectral_core.spectra.spectrum import Spectrum

from ... import compat
from .. import spectra
from ..context import Translation
from ..ledger import note_changed, note_nodes
from ..shading import surfaces  # noqa: F401  (importing surfaces registers the evaluators)
from ..shading.fields import mean_color
from ..shading.image_files import MISSING
from ..shading.images import image_of_node
from ..shading.media import medium_everywhere
from ..shading.nodes.textures import mapping_matrix
from ..shading.reader import Reader
from ..shading.tree import Input, Output, input_of, linked, searched_once, surface_output
from ..shading.walks.shaders import in_order
from ..visibility import cycles_settings, world_hidden_from
from .backgrounds import PLAIN_RAYS, Term, joined, light_paths_of, note_ray_type, resampled
from .directions import note_unsupported, of_light_path, shaders_of_world
from .patterns import needs_directions, world_light


def translate_world(
    translation: Translation, world: Any, camera: Any = None, *, is_seen: bool = False
) -> tuple[World, tuple[SunLight, ...]]:
    """Environment of a ``bpy.types.World``, and the suns of its skies; None is black, as in Blender.

    ``camera``: the scene's ``Camera``, whose space patterns may use; ``is_seen``: True if the picture is seen from it.
    """
    if world is None:
        return World(), ()
    with searched_once():
        return _translated(translation, world, camera, is_seen=is_seen)


def _translated(
    translation: Translation, world: Any, camera: Any, *, is_seen: bool
) -> tuple[World, tuple[SunLight, ...]]:
    """``translate_world`` of a world, not of None."""
    inlined = compat.inlined(world)
    tree = compat.node_tree(world) if inlined is None else inlined.node_tree
    for item in (world, getattr(world, "cycles", None)):
        note_changed(translation, world.name, item)
    note_nodes(translation, world.name, compat.node_tree(world))
    own: dict[str, Any] = {
        "group": getattr(world.original, "lightgroup", ""),  # Blender does not notify the evaluated copy of a change
        "hidden_from": world_hidden_from(world) & ~Rays.SHADOW,
        "max_bounces": cycles_settings(world, "max_bounces", 1024),
    }
    if own["max_bounces"] < min(1024, int(cycles_settings(translation.scene, "max_bounces", 12))):
        translation.note(
            world.name,
            "its light ends after its number of bounces; Cycles keeps the share that its rays find by chance",
        )
    suns: tuple[SunLight, ...] = ()
    output, medium = surface_output(tree, "OUTPUT_WORLD"), None
    if output is not None:
        medium = medium_everywhere(Reader(translation, world.name, on_surface=True), output)
    if tree is None:
        lights = sees = Term(Color(translation.linear_rgb(world.color)))
    elif needs_directions(output) or _tells_rays(translation, output):
        lights, sees, suns = world_light(translation, world, output, camera, own, is_seen=is_seen)
    else:
        reader = Reader(translation, world.name)
        lights, sees = (joined(reader, terms) for terms in _backgrounds(reader, tree))
    spectrum = spectra.spectrum_of(translation, world)
    is_own = isinstance(lights.color, Spectrum) and not lights.is_planckian
    if spectrum is not None and not is_own:  # a node's spectrum has precedence over its world's
        if suns or (isinstance(lights.color, ImageTexture) and np.ptp(lights.color.pixels, axis=(0, 1)).any()):
            translation.note(world.name, "its spectrum replaces the image, pattern or sky of its background")
        factor = spectra.strength_of(translation, world)
        light, seen = _strengths(translation, world, output, (lights, sees))
        lights, sees, suns = Term(spectrum, light * factor), Term(spectrum, seen * factor), ()
    made = World(
        color=lights.color, strength=lights.strength, world_from_environment=lights.turn, medium=medium,
        is_planckian=lights.is_planckian, **own,
    )  # fmt: skip
    if sees == lights or Rays.CAMERA & own["hidden_from"]:
        return made, suns
    view = World(color=sees.color, strength=sees.strength, world_from_environment=sees.turn)
    return replace(made, camera_view=view), suns


def _tells_rays(translation: Translation, output: Any) -> bool:
    """True if a world without spectra depends on a type of ray other than the camera's."""
    source = None if output is None else linked(input_of(output, "Surface"))
    if not light_paths_of(source) - PLAIN_RAYS:
        return False
    return all(spectra.spectrum_of(translation, each.node) is None for each, _ in in_order(source, shaders_of_world))


def _strengths(translation: Translation, world: Any, output: Any, terms: tuple[Term, Term]) -> tuple[float, float]:
    """Strength of the light of a world, and of what the camera sees, without its colors."""
    source = None if output is None else linked(input_of(output, "Surface"))
    if source is None or source.node.type not in ("BACKGROUND", "EMISSION"):
        return terms[0].strength, terms[1].strength
    reader, place = Reader(translation, world.name, on_surface=True), source.input("Strength")
    light, seen = (_number(reader, place, 1.0, camera=is_seen) for is_seen in (False, True))
    return light, seen


def _backgrounds(reader: Reader, tree: Any) -> tuple[list[Term], list[Term]]:
    """The environment for the light in the scene, and for the camera."""
    output = surface_output(tree, "OUTPUT_WORLD")
    if output is None:
        return [], []
    source = linked(input_of(output, "Surface"))
    light = _terms(reader, source, camera=False)
    # a world that does not distinguish rays is read once, so that both are the same
    return light, _terms(reader, source, camera=True) if light_paths_of(source) else light


def _terms(reader: Reader, source: Output | None, *, camera: bool) -> list[Term]:
    """The backgrounds in a shader's sum, each with its weight in its strength."""
    found: list[Term] = []
    order = in_order(source, shaders_of_world)
    weights = {item: 0.0 for item, _ in order}
    if source is not None:
        weights[source] = 1.0
    for item, before in reversed(order):  # each shader after those that read it
        weight, shares = weights[item], [1.0] * len(before)
        if weight == 0:
            continue
        kind = item.node.type
        if kind in ("BACKGROUND", "EMISSION"):
            found.append(_background(reader, item, weight, camera=camera))
        elif kind == "MIX_SHADER":
            share = _number(reader, item.input("Fac") or item.input("Factor"), 0.5, camera=camera)
            share = min(max(share, 0.0), 1.0)
            shares = [1 - share, share]
        elif kind != "ADD_SHADER":
            note_unsupported(reader, item)
        for part, by in zip(before, shares, strict=True):
            if part is not None:
                weights[part] += weight * by
    return found[::-1]


def _number(reader: Reader, place: Input | None, fallback: float, *, camera: bool) -> float:
    """A number that may depend on the type of ray: exact for camera rays, else the value for diffuse rays."""
    source = linked(place)
    if source is None or source.node.type != "LIGHT_PATH":
        return reader.number(place, fallback)
    name = source.socket.name
    if name not in PLAIN_RAYS:
        note_ray_type(reader, name)
    return of_light_path(name, camera=camera)


def _background(reader: Reader, source: Output, weight: float, *, camera: bool) -> Term:
    """One Background node."""
    strength = weight * max(_number(reader, source.input("Strength"), 1.0, camera=camera), 0.0)
    spectrum = spectra.spectrum_of(reader.translation, source.node)
    if spectrum is not None:
        return Term(spectrum, strength * spectra.strength_of(reader.translation, source.node))
    place = source.input("Color")
    image = linked(place)
    color: Paint = Color(np.array(MISSING))
    if image is not None and image.node.type == "TEX_ENVIRONMENT":
        texture = image_of_node(reader.translation, image, reader.owner)
        color = color if texture is None else replace(texture, extension="repeat")
    else:
        color = gray(1.0) if place is None else reader.paint(place, gray(1.0))
    if isinstance(color, MixedPaint):
        reader.note("the background is a mix of two colors or images; their mean was used")
        color = Color(np.broadcast_to(mean_color(reader.field(place)), (3,)))  # type: ignore[arg-type]
    if not isinstance(color, ImageTexture):
        return Term(color, strength, is_planckian=isinstance(color, Spectrum) and color.source == PLANCK)
    assert image is not None
    mapping = _mapping(reader, image)
    rotation, stretch = _polar(mapping[:3, :3])
    is_turn = np.allclose(stretch, stretch[0, 0] * np.eye(3), atol=1e-6) and not np.any(mapping[:3, 3])
    if is_turn:
        turn = np.eye(4)
        turn[:3, :3] = rotation.T
        return Term(color, strength, turn)
    return Term(resampled(color, mapping), strength)


def _mapping(reader: Reader, image: Output) -> NDArray[np.float64]:
    """Affine map (4, 4) of directions by the nodes before an environment image."""
    source = linked(image.input("Vector"))
    if source is None:
        return np.eye(4)
    if source.node.type == "TEX_COORD":
        if source.socket.name not in ("Generated", "Normal", "Object"):
            reader.note(f"the coordinates {source.socket.name!r} of the environment are not supported")
        return np.eye(4)
    if source.node.type != "MAPPING":
        reader.note(f"{source.label!r} before the environment image is not supported")
        return np.eye(4)
    return np.asarray(mapping_matrix(reader, source), dtype=np.float64)


def _polar(matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nearest orthogonal matrix, and the rest: matrix = rotation @ stretch."""
    left, lengths, right = np.linalg.svd(matrix)
    return left @ right, right.T @ np.diag(lengths) @ right
