# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a world's AOV Output nodes along the rays of the camera that meet the world."""

from __future__ import annotations

from typing import Any

import bpy

from spectral_core.scene import Computed, Rays, Scene

from ... import compat
from ..camera import translate_film
from ..context import Translation, overridden
from ..shading.aovs import aov_inputs
from ..shading.reader import Reader
from ..shading.tree import searched_once
from ..visibility import world_hidden_from
from .along_rays import along_rays
from .directions import Look


def outputs_of_world(depsgraph: Any, scene: Scene) -> tuple[tuple[str, Computed], ...]:
    """Name and program of each AOV of the view layer that the world gives, for ``Passes.of_world``.

    ``scene``: the translated scene, whose camera the nodes may read.
    """
    world = overridden(depsgraph, "world_override") or depsgraph.scene_eval.world
    if world is None or not depsgraph.view_layer_eval.use_sky or Rays.CAMERA & world_hidden_from(world):
        return ()
    translation = Translation.of(depsgraph, bpy.data)
    window = scene.camera.window(translate_film(translation.scene, 1, 0))
    look = Look(scene.camera.space_from_world, camera=True, window=window)
    inlined = compat.inlined(world)
    tree = compat.node_tree(world) if inlined is None else inlined.node_tree
    reader, found = Reader(translation, world.name, on_surface=True, is_far=True, in_world=True), []
    with searched_once():
        for name, _, place in aov_inputs(depsgraph, tree):
            value = reader.as_value(reader.field(place))
            found.append((name, Computed(along_rays(value.program(3), look))))
    return tuple(found)
