# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting that the ledger lists as read changes the translated scene or its notes, and can be reset.

A setting that is removed from the translation of lamps, cameras, objects or the output therefore fails a test here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.translate.ledger import entries
from tests.settings_walk import ignored_settings, other_rna, read_rna

NODES = {"use_nodes": "on for everything since Blender 5"}
BORDER = {"use_border": True, "border_min_x": 0.2, "border_max_x": 0.8, "border_min_y": 0.3, "border_max_y": 0.7}
INSTANCES = (
    "instance_type instance_collection instance_faces_scale use_instance_faces_scale use_instance_vertices_rotation "
    "show_instancer_for_render"
)
POSE = (
    "parent_bone parent_bone_head_tail_factor parent_type parent_vertices use_parent_final_indices track_axis up_axis "
    "delta_rotation_quaternion rotation_axis_angle rotation_mode rotation_quaternion matrix_basis matrix_local "
    "matrix_parent_inverse matrix_world data parent"
)


@dataclass(frozen=True)
class Case:
    """Settings of one Blender type.

    ``kind``: its name in the ledger. ``made``: makes the scene and gives the struct. ``first``: values that must be
    set before others count. ``others``: values to change to, where not any other will do. ``besides``: what is not
    walked, and why.
    """

    kind: str
    made: Callable[[Any], Any]
    first: dict[str, Any] = field(default_factory=dict)
    others: dict[str, Any] = field(default_factory=dict)
    besides: dict[str, str] = field(default_factory=dict)


def _simplified(struct: str) -> Callable[[Any], Any]:
    def made(build: Any) -> Any:
        bpy.context.scene.render.use_simplify = True
        return _scene(struct)(build)

    return made


def _lamp(kind: str, of: str | None = None) -> Callable[[Any], Any]:
    def made(build: Any) -> Any:
        lamp = build.light(kind).data
        return lamp if of is None else getattr(lamp, of)

    return made


def _object(build: Any) -> Any:
    bpy.context.scene.world = None
    return build.plane(material=build.material())


def _camera(build: Any) -> Any:
    return build.camera().data


def _orthographic(build: Any) -> Any:
    return build.camera(type="ORTHO").data


def _scene(part: str) -> Callable[[Any], Any]:
    def made(build: Any) -> Any:
        build.plane(material=build.material())
        return getattr(bpy.context.scene, part)

    return made


def _words(text: str, reason: str) -> dict[str, str]:
    return dict.fromkeys(text.split(), reason)


def _world(of: str | None = None) -> Callable[[Any], Any]:
    def made(build: Any) -> Any:
        from blender_addon import compat

        world = bpy.context.scene.world = bpy.data.worlds.new("World")
        compat.use_nodes(world)
        return world if of is None else getattr(world, of)

    return made


def _material(of: str | None = None) -> Callable[[Any], Any]:
    """A half transparent, displaced material of a plane."""

    def made(build: Any) -> Any:
        material = build.material(shader="ShaderNodeBsdfPrincipled", Alpha=0.5)
        tree = material.node_tree
        moved = tree.nodes.new("ShaderNodeDisplacement")
        moved.inputs["Scale"].default_value = 0.3
        tree.links.new(
            moved.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Displacement"]
        )
        build.plane(material=material)
        return material if of is None else getattr(material, of)

    return made


def _layer(of: str | None = None) -> Callable[[Any], Any]:
    def made(build: Any) -> Any:
        _world()(build)
        collection = bpy.data.collections.new("Own")
        bpy.context.scene.collection.children.link(collection)
        plane = build.plane(material=build.material())
        bpy.context.scene.collection.objects.unlink(plane)
        collection.objects.link(plane)
        bpy.context.scene.render.use_freestyle = True  # a layer's Freestyle is named only beside it
        layer = bpy.context.view_layer
        return layer.layer_collection.children["Own"] if of == "collection" else layer if of is None else layer.cycles

    return made


WARM = {"use_temperature": True}
PANORAMA = _words(
    "panorama_type fisheye_fov fisheye_lens latitude_min latitude_max longitude_min longitude_max "
    "fisheye_polynomial_k0 fisheye_polynomial_k1 fisheye_polynomial_k2 fisheye_polynomial_k3 fisheye_polynomial_k4 "
    "central_cylindrical_range_u_min central_cylindrical_range_u_max central_cylindrical_range_v_min "
    "central_cylindrical_range_v_max central_cylindrical_radius custom_filepath custom_shader custom_mode "
    "custom_bytecode custom_bytecode_hash",
    "a camera of such a type is named as a whole",
)
LENS = {**PANORAMA, "angle_x": "another word for lens", "angle_y": "another word for lens", "lens_unit": "a unit"}
CASES = {
    "point": Case("PointLight", _lamp("POINT"), WARM, {"type": "SPOT"}, NODES),
    "spot": Case("SpotLight", _lamp("SPOT"), WARM, {"type": "POINT"}, NODES),
    "sun": Case("SunLight", _lamp("SUN"), WARM, {"type": "POINT"}, NODES),
    "area": Case(
        "AreaLight", _lamp("AREA"), {**WARM, "shape": "RECTANGLE", "size_y": 2.0},
        {"type": "POINT", "shape": "ELLIPSE"}, NODES,
    ),
    "lamp in Cycles": Case("CyclesLightSettings", _lamp("AREA", "cycles")),
    "perspective": Case(
        "Camera", _camera, {"sensor_fit": "VERTICAL"}, {"type": "ORTHO", "sensor_fit": "HORIZONTAL"},
        {**LENS, "ortho_scale": "orthographic", "sensor_width": "of the other fit"},
    ),
    "wide sensor": Case(
        "Camera", _camera, {"sensor_fit": "HORIZONTAL"}, {"type": "ORTHO", "sensor_fit": "VERTICAL"},
        {**LENS, "ortho_scale": "orthographic", "sensor_height": "of the other fit"},
    ),
    "orthographic": Case(
        "Camera", _orthographic, {}, {"type": "PERSP"},
        {**LENS, **_words("angle lens sensor_width sensor_height", "perspective"), "sensor_fit": "of a square picture"},
    ),
    "depth of field": Case(
        "CameraDOFSettings", lambda build: _camera(build).dof, {"use_dof": True}, {},
        {"focus_object": "tests/blender/surfaces/test_translate_rays.py", "aperture_rotation": "of a lens with blades",
         "focus_subtarget": "tests/blender/engine/test_focus_on_bones.py"},
    ),
    "object": Case(
        "Object", _object, {}, {"lightgroup": "another", "rotation_euler": (0.3, 0.2, 0.1)},
        _words(INSTANCES, "makes other objects") | _words(POSE, "Blender's own matrices")
        | {"hide_render": "Blender's own depsgraph leaves it out of renders", "dimensions": "another word for scale"},
    ),
    "world": Case("World", _world(), {}, {"lightgroup": "another"}, {**NODES, "color": "of a world without nodes"}),
    "world in Cycles": Case("CyclesWorldSettings", _world("cycles"), {}, {"max_bounces": 3}),
    "rays of a world": Case("CyclesVisibilitySettings", _world("cycles_visibility")),
    "material": Case("Material", _material(), besides={**NODES, "diffuse_color": "of a material without nodes"}),
    "material in Cycles": Case(
        "CyclesMaterialSettings", _material("cycles"),
        besides={"volume_interpolation": "of grids: tests/blender/volumes/test_coarse_grids.py"},
    ),
    "layer collection": Case("LayerCollection", _layer("collection")),
    "view layer": Case(
        "ViewLayer", _layer(), {}, {},
        {
            **_words(" ".join(n for n in entries()["ViewLayer"].read if n.startswith(("use_pass", "pass_"))),
                     "the engine's passes: tests/blender_ui/panels/test_passes_panel.py"),
            **_words("use use_motion_blur", "the engine's"),
            **_words("material_override world_override", "pointers: tests/blender/nodes/test_translate_combined.py"),
            **_words("use_solid use_strand use_volumes", "of kinds of objects: rendered_cases.py"),
        },
    ),
    "view layer in Cycles": Case(
        "CyclesRenderLayerSettings", _layer("cycles"), {}, {},
        _words(" ".join(entries()["CyclesRenderLayerSettings"].read), "the engine's passes"),
    ),
    "output": Case(
        "RenderSettings", _scene("render"), BORDER | {"use_simplify": True},
        {"engine": "BLENDER_EEVEE", "resolution_percentage": 50},
        {
            **_words("use_simplify simplify_subdivision simplify_subdivision_render simplify_child_particles "
                     "simplify_child_particles_render use_simplify_normals hair_type hair_subdiv",
                     "act on meshes before the translation"),
            "engine": "chooses this engine",
            **_words("motion_blur_shutter motion_blur_position", "of motion blur, which is named as a whole"),
            **_words("frame_map_old frame_map_new", "of time: rendered_cases.py"),
            **_words(
                "use_crop_to_border use_multiview views_format", "the engine's: tests/blender/engine/test_engine.py"
            ),
        },
    ),
    "light paths": Case(
        "CyclesRenderSettings", _simplified("cycles"),
        besides={
            **_words("use_camera_cull use_distance_cull camera_cull_margin distance_cull_margin",
                     "of Simplify and of objects that it may cull: tests/blender/surfaces/test_translate_rays.py"),
        },
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_every_setting_listed_as_read_changes_the_translation(build, translate, name):
    case = CASES[name]
    owner = case.made(build)
    for first, value in case.first.items():
        setattr(owner, first, value)
    declared = {each.identifier for each in owner.bl_rna.properties if not each.is_readonly}
    listed = entries()[case.kind].read | set(entries()[case.kind].noted)
    names = sorted((listed & declared) - set(case.besides))
    assert names

    def write(setting: str, value: Any) -> None:
        setattr(owner, setting, value)
        owner.id_data.update_tag()

    def other(setting: str) -> Any:
        return case.others[setting] if setting in case.others else other_rna(owner, setting)

    assert ignored_settings(names, lambda setting: read_rna(owner, setting), write, other, translate) == {}
