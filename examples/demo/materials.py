# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's materials: plain Principled nodes, and the vase's two glazes with the painted branch between them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import drawing

Color = tuple[float, float, float]

VASE, GROUND, MARK, BRANCH = "Vase glaze", "Ground", "Mark", "Branch"
"""The vase's material, the nodes of its two glazes, and the node that holds the mask."""


class Materials:
    """Makes each material once per name; holds bpy so that importing this module needs none."""

    def __init__(self, bpy: Any) -> None:
        self.bpy = bpy

    def plain(self, name: str, color: Color, roughness: float = 0.5) -> Any:
        """A Principled material of one linear color."""
        found = self.bpy.data.materials.get(name)
        if found is not None:
            return found
        made = self.bpy.data.materials.new(name)
        if made.node_tree is None:
            made.use_nodes = True  # Blender before 5.0 does not create a node tree by itself
        node = made.node_tree.nodes["Principled BSDF"]
        node.inputs["Base Color"].default_value = (*color, 1.0)
        node.inputs["Roughness"].default_value = roughness
        return made

    def pictured(self, name: str, pixels: NDArray[np.float32], roughness: float) -> Any:
        """A Principled material whose color is a picture, packed into the .blend."""
        made = self.plain(name, (0.8, 0.8, 0.8), roughness)
        texture = made.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = self.image(name, pixels)
        made.node_tree.links.new(texture.outputs["Color"], made.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
        return made

    def image(self, name: str, pixels: NDArray[np.float32], *, is_data: bool = False) -> Any:
        """A packed picture; ``is_data`` where its numbers are no colors."""
        height, width = pixels.shape[:2]
        image = self.bpy.data.images.new(name, width, height, is_data=is_data)
        image.pixels.foreach_set(np.dstack([pixels, np.ones((height, width, 1), np.float32)]).ravel())
        image.pack()
        return image

    def glaze(self) -> Any:
        """Two glazes of one color, and the painted branch that chooses between them."""
        color = (0.50, 0.52, 0.47)
        made = self.plain(VASE, color, 0.42)
        nodes, links = made.node_tree.nodes, made.node_tree.links
        ground, output = nodes["Principled BSDF"], nodes["Material Output"]
        mark, mix = nodes.new("ShaderNodeBsdfPrincipled"), nodes.new("ShaderNodeMixShader")
        mask = nodes.new("ShaderNodeTexImage")
        for node, name in ((ground, GROUND), (mark, MARK), (mask, BRANCH)):
            node.name = node.label = name
        mark.inputs["Base Color"].default_value = (*color, 1.0)
        mark.inputs["Roughness"].default_value = 0.42
        mask.image = self.image(BRANCH, np.repeat(drawing.branch_mask()[..., None], 3, axis=2), is_data=True)
        links.new(mask.outputs["Color"], mix.inputs[0])
        links.new(ground.outputs["BSDF"], mix.inputs[1])
        links.new(mark.outputs["BSDF"], mix.inputs[2])
        links.new(mix.outputs["Shader"], output.inputs["Surface"])
        places = {mask: (-320, 320), ground: (0, 320), mark: (0, -320), mix: (340, 120), output: (540, 120)}
        for node, place in places.items():
            node.location = place
        return made
