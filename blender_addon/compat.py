# SPDX-License-Identifier: GPL-3.0-or-later
"""Differences between Blender 4.3, 5.0 and 5.2, found by queries to Blender itself: no version number is compared."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from mathutils import Color
from numpy.typing import NDArray

# RGB to XYZ of each scene-linear space that Blender offers, white adapted to D65 (Bradford), as its OpenColorIO
# configuration does: only the product with sRGB's inverse is used, so a common scale does not matter.
_REC709_FROM = {
    "Linear Rec.709": np.eye(3),
    "Linear Rec.2020": np.array(
        [
            [1.6604910, -0.5876411, -0.0728499],
            [-0.1245505, 1.1328999, -0.0083494],
            [-0.0181508, -0.1005789, 1.1187297],
        ]
    ),
    "ACEScg": np.array(
        [
            [1.7050510, -0.6217921, -0.0832589],
            [-0.1302564, 1.1408048, -0.0105483],
            [-0.0240034, -0.1289690, 1.1529724],
        ]
    ),
}


def path_options() -> set[str]:
    """Options of a property with a path that may start with ``//``: from 5.0 on they are required for it.

    Without them Blender shows such a path in red, as an error, although it is resolved.
    """
    known = bpy.types.StringProperty.bl_rna.properties
    return {"ANIMATABLE"} | ({"PATH_SUPPORTS_BLEND_RELATIVE"} if "is_path_supports_blend_relative" in known else set())


def working_space(data: Any) -> str:
    """Name of the scene-linear space of ``bpy.data``; before 5.0 files have none, and that of the colors counts."""
    colorspace = getattr(data, "colorspace", None)
    if colorspace is not None:
        return str(colorspace.working_space)
    return _name_of_present() or "scene_linear"


def rec709_from_working(name: str) -> NDArray[np.float64]:
    """Matrix (3, 3) from a scene-linear space of Blender to linear sRGB.

    A name that Blender's own configuration lacks is that of the present space of the one that ``$OCIO`` names.
    """
    known = name if name in _REC709_FROM else _name_of_present()
    return _rec709_from_present() if known is None else _REC709_FROM[known]


def _name_of_present() -> str | None:
    """Blender's name of the scene-linear space that it has now; None for a space of another configuration."""
    measured = _rec709_from_present()
    return next((name for name, known in _REC709_FROM.items() if np.allclose(known, measured, atol=1e-4)), None)


def _rec709_from_present() -> NDArray[np.float64]:
    """Matrix (3, 3) from the scene-linear space that Blender has now to linear sRGB, in single precision."""
    columns = [Color(axis).from_scene_linear_to_rec709_linear() for axis in np.eye(3)]
    return np.array(columns, dtype=np.float64).T


LINEAR_REC709 = ("Linear Rec.709", "Linear Rec.709 (sRGB)", "Utility - Linear - sRGB", "Linear")
"""Names of linear sRGB: in Blender's own configuration, in those of ACES from 2 on and before, and in old ones."""


def set_linear_rec709(image: Any) -> None:
    """Let the numbers of an image of floats be linear sRGB, by the name that the present configuration has for it."""
    for name in LINEAR_REC709:
        with contextlib.suppress(TypeError):  # no such space
            image.colorspace_settings.name = name
            return


def node_tree(owner: Any) -> Any:
    """Shader node tree of a material, world or light, or None if it uses none.

    5.x announces the removal of ``use_nodes``: there a material and a world always use nodes.
    """
    tree = getattr(owner, "node_tree", None)
    if tree is None:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return tree if getattr(owner, "use_nodes", True) else None


INLINED = (
    "GeometryNode", "NodeClosure", "NodeEvaluateClosure", "NodeCombineBundle", "NodeSeparateBundle", "NodeEnableOutput",
    "NodeJoinBundle", "NodeGetBundleItem", "NodeStoreBundleItem",
)  # fmt: skip
"""Beginnings of the types of nodes that Blender itself replaces by shader nodes before a render, from 5.0 on."""


def inlined(owner: Any) -> Any:
    """Blender's copy of the nodes of a material, light or world without repeat zones, closures, bundles and menus, with
    constants converted at sockets of groups and at muted nodes, and with the output nodes of groups in the tree itself;
    None if there are none of these. Its ``node_tree`` exists as long as the copy.
    """
    make = getattr(owner, "inline_shader_nodes", None)
    return make() if make is not None and _is_inlined(node_tree(owner), set()) else None


def converts_in_groups() -> bool:
    """True for Cycles of Blender 4, which converts each value to the types of the sockets of groups and muted nodes."""
    return not computes_constants()


def computes_constants() -> bool:
    """True from Blender 5.0 on, which itself computes what nodes make of constants alone, before Cycles reads them."""
    return hasattr(bpy.types.Material, "inline_shader_nodes")


def _is_inlined(tree: Any, seen: set[int]) -> bool:
    if tree is None or tree.as_pointer() in seen:
        return False
    is_group = bool(seen)
    seen.add(tree.as_pointer())
    return any(
        node.bl_idname.startswith(INLINED)
        or (is_group and node.type in OUTPUTS)
        or (node.type == "GROUP" and _is_inlined(node.node_tree, seen))
        or ((node.mute or node.type in PASSING) and _converts(node))
        for node in tree.nodes
    )


PASSING = ("GROUP", "GROUP_OUTPUT")
OUTPUTS = ("OUTPUT_MATERIAL", "OUTPUT_WORLD", "OUTPUT_LIGHT")


def _converts(node: Any) -> bool:
    """True if a node that passes values on may change their type: from 5.0 on Blender converts constants there."""
    came = {(link.from_socket.type, link.to_socket.type) for socket in node.inputs for link in socket.links}
    kinds = {kind for pair in came for kind in pair}
    if node.mute:
        kinds |= {link.to_socket.type for socket in node.outputs for link in socket.links}
        return len(kinds - {"SHADER"}) > 1
    return any(one != other for one, other in came)


def use_nodes(owner: Any) -> Any:
    """The shader node tree of a new material, world or light, created if this Blender does not create it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        if owner.node_tree is None or not owner.use_nodes:
            owner.use_nodes = True
    return owner.node_tree


def is_editable(block: Any) -> bool:
    """True if a data-block keeps this extension's properties: it is neither linked nor an override."""
    return block.library is None and block.override_library is None


def collection_for_new(context: Any, scene: Any) -> Any:
    """Collection that gets a new object: the active one, or the scene's own one.

    The scene's own one, as for Blender's new objects, if the active one is linked or an override, which takes no
    object, or if the window shows another scene by now.
    """
    has_active = scene == context.scene and is_editable(context.collection)
    return context.collection if has_active else scene.collection


def light_exposure_factor(light: Any) -> float:
    """Factor of a light's exposure in stops; 1 if this Blender's lights have none."""
    return float(2.0 ** getattr(light, "exposure", 0.0))


def light_is_normalized(light: Any) -> bool:
    """True if a light's power is spread over its area, as always before 4.5."""
    return bool(getattr(light, "normalize", True))


def lamps_follow_instancers() -> bool:
    """True from 4.5 on, whose Cycles treats lamps as objects: what shows an instance of one hides it, too."""
    return "normalize" in bpy.types.Light.bl_rna.properties


def light_temperature_k(light: Any) -> float | None:
    """Blackbody temperature of a light in kelvin, None if it is unused or unsupported."""
    return float(light.temperature) if getattr(light, "use_temperature", False) else None


def switch_temperature_off(light: Any) -> None:
    """Let a light have its color alone; before 4.5 it always has."""
    if hasattr(light, "use_temperature"):
        light.use_temperature = False


def set_image_format(settings: Any, file_format: str, **options: Any) -> None:
    """Choose how a render is saved: from 5.0 on the type of media must be set before the format."""
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE" if file_format == "OPEN_EXR_MULTILAYER" else "IMAGE"
    settings.file_format = file_format
    for name, value in options.items():
        setattr(settings, name, value)


OF_IMAGE_FORMATS = (
    "media_type", "file_format", "color_mode", "color_depth", "compression", "color_management", "views_format",
)  # fmt: skip
"""Settings of saved renders in an order in which they can be set: each limits the choices of the next."""


def output_settings(render: Any) -> list[tuple[Any, str, Any]]:
    """Everything that another format of saved renders may change: owner, name and value, in an order to restore it.

    With a movie format Blender replaces settings of the movie that it holds for invalid, so these come after it.
    """
    image, movie = render.image_settings, render.ffmpeg
    names = [prop.identifier for prop in movie.bl_rna.properties if not prop.is_readonly]
    of_movie = sorted(names, key=lambda name: (name != "format", "codec" not in name))
    ordered = [(image, name) for name in OF_IMAGE_FORMATS[:2]] + [(movie, name) for name in of_movie]
    ordered += [(image, name) for name in OF_IMAGE_FORMATS[2:]]
    if getattr(image, "has_linear_colorspace", False):  # else its name is none that can be set
        ordered += [(image.linear_colorspace_settings, "name")]
    return [(owner, name, getattr(owner, name)) for owner, name in ordered if hasattr(owner, name)]


@contextlib.contextmanager
def image_format(render: Any, file_format: str, **options: Any) -> Iterator[None]:
    """Choose how a render is saved, and restore the earlier choice at the end, be it a movie or a multilayer file."""
    kept = output_settings(render)
    try:
        set_image_format(render.image_settings, file_format, **options)
        yield
    finally:
        for owner, name, value in kept:
            if getattr(owner, name) != value:
                setattr(owner, name, value)


def curves_of(animation: Any) -> list[Any]:
    """The collections of curves that animate a data-block by its action; before 4.4 an action has one itself."""
    slot = getattr(animation, "action_slot", None)
    if not hasattr(animation.action, "layers") or slot is None:
        return [animation.action.fcurves] if hasattr(animation.action, "fcurves") else []
    bags = [strip.channelbag(slot) for layer in animation.action.layers for strip in layer.strips]
    return [bag.fcurves for bag in bags if bag is not None]


def is_before_5_0() -> bool:
    """True for Cycles of older versions, whose surface of objects without a material is matt, and whose Principled
    Volume reads its grids between the voxels.
    """
    return "media_type" not in bpy.types.ImageFormatSettings.bl_rna.properties


def is_before_5_2() -> bool:
    """True for Cycles of older versions, which divides a mesh at its sharp edges, so that displaced faces come apart
    there, and whose Magic Texture has seams.
    """
    return "convention" not in bpy.types.ShaderNodeNormalMap.bl_rna.properties
