# SPDX-License-Identifier: GPL-3.0-or-later
"""The node Spectral Texture: a file of ``spectral-scene texture`` that any color socket of a shader can read.

It contains a group with the texture's picture under D65, so that EEVEE and Cycles show an approximation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from ..compat import path_options
from . import hooks
from .hooks import Topic

if TYPE_CHECKING:
    from bpy.types import Context, UILayout

NODE = "SpectralSceneTexture"
EXTENSIONS = (
    ("REPEAT", "Repeat", "Repeat the texture"),
    ("EXTEND", "Extend", "Repeat its last texels"),
    ("MIRROR", "Mirror", "Repeat and mirror the texture"),
)
INTERPOLATIONS = (
    ("Linear", "Linear", "Mix the four nearest texels; a mix of reflectances is a reflectance"),
    ("Closest", "Closest", "Take the nearest texel"),
)


def _show_as_set(node: SpectralTextureNode, _context: Context) -> None:
    """Blender's own views repeat and filter the picture as the renderer does the texture."""
    for inner in () if node.node_tree is None else node.node_tree.nodes:
        if inner.bl_idname == "ShaderNodeTexImage":
            inner.interpolation, inner.extension = node.interpolation, node.extension


class SpectralTextureNode(bpy.types.ShaderNodeCustomGroup):
    """A texture whose texels are reflectances: it can show another picture under another light"""

    bl_idname = NODE
    bl_label = "Spectral Texture"

    filepath: bpy.props.StringProperty(
        name="File",
        description="Spectral texture (.exr) that `spectral-scene texture` wrote",
        subtype="FILE_PATH",
        options=path_options(),
        update=hooks.announces(Topic.SPECTRAL_TEXTURE),
    )
    interpolation: bpy.props.EnumProperty(name="Interpolation", items=INTERPOLATIONS, update=_show_as_set)
    extension: bpy.props.EnumProperty(name="Extension", items=EXTENSIONS, update=_show_as_set)
    message: bpy.props.StringProperty(name="Message", description="Reason why the file cannot be used")

    def init(self, _context: Context) -> None:
        """Create the group that shows the picture in engines without spectra."""
        tree = bpy.data.node_groups.new(".Spectral Texture", "ShaderNodeTree")
        tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
        end, image = tree.nodes.new("NodeGroupOutput"), tree.nodes.new("ShaderNodeTexImage")
        tree.links.new(image.outputs["Color"], end.inputs[0])
        self.node_tree = tree

    def copy(self, node: SpectralTextureNode) -> None:
        """Give a copy its own group, so that its file can differ."""
        if node.node_tree is not None:
            self.node_tree = node.node_tree.copy()

    def free(self) -> None:
        """Remove the group with its last node."""
        if self.node_tree is not None and self.node_tree.users <= 1:
            bpy.data.node_groups.remove(self.node_tree)

    def draw_buttons(self, _context: Context, layout: UILayout) -> None:
        """Show the file and how it is read."""
        layout.prop(self, "filepath", text="")
        layout.prop(self, "interpolation", text="")
        layout.prop(self, "extension", text="")
        if self.message:
            layout.label(text=self.message, icon="ERROR")


CLASSES = (SpectralTextureNode,)


def register() -> None:
    """Register the node, and its entry in the shader editor's Add menu."""
    bpy.utils.register_class(SpectralTextureNode)
    bpy.types.NODE_MT_category_shader_texture.append(_add_entry)


def unregister() -> None:
    """Remove the node."""
    bpy.types.NODE_MT_category_shader_texture.remove(_add_entry)
    bpy.utils.unregister_class(SpectralTextureNode)


def _add_entry(menu: bpy.types.Menu, _context: Context) -> None:
    entry = menu.layout.operator("node.add_node", text="Spectral Texture")
    entry.type = NODE
    entry.use_transform = True
