# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of cameras, motion, views, passes, images and instances, each in a scene in which it matters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from blender_addon.translate.ledger import entries
from tests.blender import image_stages, stages

MOVED = {"use_motion_blur": True, "motion_blur_shutter": 1.0}


@dataclass(frozen=True)
class Case:
    """Settings ``names`` of a Blender type.

    ``kind``: its name in the ledger. ``made``: makes the scene and gives the struct. ``first``: values that must be set
    before others count. ``others``: values to change to, where not any other will do.
    ``stays``: True if Blender itself does not return to the former state. ``part``: of the scene, that must change.
    """

    kind: str
    made: Callable[[Any, Path], Any]
    names: str
    first: dict[str, Any] = field(default_factory=dict)
    others: dict[str, Any] = field(default_factory=dict)
    stays: bool = False
    part: str = ""


def _of(made: Callable[[Any, Path], Any], *path: str) -> Callable[[Any, Path], Any]:
    """A struct within the one that is made."""

    def found(build: Any, folder: Path) -> Any:
        owner = made(build, folder)
        for name in path:
            owner = owner[name] if name == "right" else getattr(owner, name)
        return owner

    return found


def _beside(made: Callable[[Any, Path], Any], found: Callable[[], Any]) -> Callable[[Any, Path], Any]:
    """Another struct of the scene that is made."""
    return lambda build, folder: (made(build, folder), found())[1]


def _panorama(names: str, **first: Any) -> Case:
    return Case("Camera", stages.lens, names, {"type": "PANO", "sensor_width": 30.0, "sensor_height": 20.0, **first})


def _passes(kind: str, besides: str = "") -> str:
    entry = entries()[kind]
    names = {name for name in entry.read | set(entry.noted) if "pass" in name} - set(besides.split())
    return " ".join(sorted(names))


FACES = {"instance_type": "FACES", "use_instance_faces_scale": True}
PLACES = "sensor_fit sensor_width"
CASES = {
    "equirectangular": _panorama("type panorama_type longitude_min longitude_max latitude_min latitude_max",
                                 panorama_type="EQUIRECTANGULAR"),
    "equidistant": _panorama("fisheye_fov", panorama_type="FISHEYE_EQUIDISTANT"),
    "equisolid": _panorama("fisheye_fov fisheye_lens sensor_fit sensor_width", panorama_type="FISHEYE_EQUISOLID"),
    "polynomial": _panorama(
        "fisheye_fov fisheye_polynomial_k0 fisheye_polynomial_k1 fisheye_polynomial_k2 fisheye_polynomial_k3 "
        "fisheye_polynomial_k4 sensor_height", panorama_type="FISHEYE_LENS_POLYNOMIAL", sensor_fit="VERTICAL",
    ),
    "cylinder": _panorama(
        "central_cylindrical_range_u_min central_cylindrical_range_u_max central_cylindrical_range_v_min "
        "central_cylindrical_range_v_max central_cylindrical_radius", panorama_type="CENTRAL_CYLINDRICAL",
    ),
    "picture of a panorama": Case("RenderSettings", stages.panoramic_output,
                                  "resolution_x resolution_y pixel_aspect_x pixel_aspect_y", part="camera"),
    "tall panorama": Case("Camera", stages.tall_panorama, "sensor_fit", others={"sensor_fit": "HORIZONTAL"},
                          part="camera"),
    "custom": _panorama("panorama_type", panorama_type="EQUIANGULAR_CUBEMAP_FACE"),
    "blades": Case("CameraDOFSettings", _of(stages.lens, "dof"),
                   "use_dof focus_object focus_distance aperture_fstop aperture_blades aperture_ratio "
                   "aperture_rotation",
                   {"use_dof": True, "aperture_blades": 5}, {"focus_object": "Plane"}),
    "motion": Case("RenderSettings", stages.moving_output,
                   "use_motion_blur motion_blur_shutter motion_blur_position resolution_x resolution_y frame_map_old "
                   "frame_map_new", MOVED),
    "moment": Case("Scene", stages.later, "frame_subframe frame_current", others={"frame_subframe": 0.5,
                   "frame_current": 4}, part="moments"),
    "moving object": Case("CyclesObjectSettings", _of(stages.flight, "cycles"),
                          "use_motion_blur use_deform_motion motion_steps"),
    "moving camera": Case("CyclesObjectSettings", _of(stages.moving_camera, "cycles"), "use_motion_blur motion_steps"),
    "motion of a layer": Case("ViewLayer", _beside(stages.flight, lambda: bpy.context.view_layer), "use_motion_blur"),
    "stereo": Case("CameraStereoData", _of(stages.stereo, "stereo"),
                   "convergence_mode pivot interocular_distance convergence_distance"),
    "spherical stereo": Case("CameraStereoData", _of(stages.panoramic_stereo, "stereo"), "use_spherical_stereo"),
    "stereo output": Case("RenderSettings", stages.views, "use_multiview views_format"),
    "view": Case("SceneRenderView", _of(stages.views, "views", "right"), "camera_suffix use",
                 others={"camera_suffix": "_T"}),
    "image": Case("Image", image_stages.image_file, "filepath source alpha_mode",
                  others={"filepath": "other.png", "source": "SEQUENCE", "alpha_mode": "NONE"}),
    **{f"alpha {mode} of {kind}": Case("Image", made, "alpha_mode", {"alpha_mode": mode}, {"alpha_mode": other})
       for kind, made in (("bytes", image_stages.image_file), ("a read alpha", image_stages.image_with_alpha))
       for mode, other in (("STRAIGHT", "PREMUL"), ("CHANNEL_PACKED", "STRAIGHT"), ("NONE", "STRAIGHT"))},
    "alpha of a sequence": Case("Image", _beside(image_stages.sequence, lambda: bpy.data.images["walk_0003.png"]),
                                "alpha_mode", others={"alpha_mode": "CHANNEL_PACKED"}),
    "generated": Case("Image", image_stages.generated,
                      "generated_type generated_width generated_height generated_color use_generated_float",
                      others={"generated_type": "UV_GRID", "generated_width": 8, "generated_height": 8,
                              "generated_color": (0.2, 0.4, 0.8, 0.5)}),
    "color space": Case("ColorManagedInputColorspaceSettings", _of(image_stages.image_file, "colorspace_settings"),
                        "name", others={"name": "Linear Rec.709"}),
    "sequence": Case("ImageUser", image_stages.sequence,
                     "frame_duration frame_offset frame_start use_cyclic",
                     others={"frame_start": 3, "frame_duration": 3}),
    "texture space": Case("Mesh", stages.coordinates, "texspace_location texspace_size",
                          {"texspace_location": (0.1, 0.2, 0.3), "texspace_size": (2.0, 3.0, 4.0)}),
    "automatic texture space": Case("Mesh", stages.coordinates, "use_auto_texspace", stays=True,
                                    first={"texspace_location": (0.1, 0.2, 0.3)}),
    "collection": Case("Collection", _of(stages.grouped, "instance_collection"), "instance_offset hide_render"),
    "instancer": Case("Object", stages.grouped,
                      "instance_type instance_collection hide_render visible_camera is_holdout",
                      others={"instance_type": "NONE", "instance_collection": "Lone"}),
    "member": Case("Object", _beside(stages.grouped, lambda: bpy.data.objects["Plane"]),
                   "hide_render visible_diffuse is_shadow_catcher"),
    "faces": Case("Object", stages.on_faces, "instance_type use_instance_faces_scale instance_faces_scale "
                  "show_instancer_for_render", FACES, {"instance_type": "VERTS"}),
    "vertices": Case("Object", stages.on_faces, "use_instance_vertices_rotation", {"instance_type": "VERTS"}),
    "light linking": Case("ObjectLightLinking", _of(stages.lit_and_dark, "light_linking"),
                          "receiver_collection blocker_collection",
                          others=dict.fromkeys(("receiver_collection", "blocker_collection"), "Dark")),
    "linked object": Case("CollectionLightLinking", stages.of_a_member, "link_state", others={"link_state": "EXCLUDE"}),
    "linked collection": Case("CollectionLightLinking", stages.of_a_child, "link_state",
                              others={"link_state": "EXCLUDE"}),
    "slot": Case("MaterialSlot", stages.slot, "link material", others={"link": "DATA", "material": "Third"}),
    "AOV": Case("AOV", stages.aov, "type"),
    "passes": Case("ViewLayer", stages.layer_of_passes,
                   _passes("ViewLayer", "use_pass_combined") + " material_override world_override",
                   {"use_pass_cryptomatte_object": True},
                   {"material_override": "Second", "world_override": "Other"}),
    "passes of Cycles": Case("CyclesRenderLayerSettings", _of(stages.layer_of_passes, "cycles"),
                             _passes("CyclesRenderLayerSettings")),
    "scene": Case("Scene", stages.scene_of_two, "camera world frame_current frame_subframe frame_float background_set",
                  others={"camera": "Second", "world": "Other", "frame_current": 3, "frame_subframe": 0.5,
                          "frame_float": 2.5, "background_set": "Set"}),
    "culling": Case("CyclesRenderSettings", stages.culled,
                    "use_camera_cull use_distance_cull distance_cull_margin camera_cull_margin",
                    others={"distance_cull_margin": 50.0, "camera_cull_margin": 9.0}),
    "culled object": Case("CyclesObjectSettings", stages.cut, "use_distance_cull use_adaptive_subdivision ao_distance"),
    "camera cull of an object": Case(
        "CyclesObjectSettings", _beside(stages.culled, lambda: bpy.data.objects["Behind"].cycles),
        "use_camera_cull"),
    "simplify": Case("RenderSettings", stages.shaped, "use_simplify simplify_subdivision_render",
                     {"simplify_subdivision_render": 1}),
    "cloud": Case("Volume", stages.cloud, "filepath is_sequence frame_start frame_duration frame_offset",
                  {"frame_start": 2}, {"frame_duration": 1, "filepath": "fog_0003.vdb"}),
    "end of a cloud": Case("Volume", stages.cloud, "sequence_mode", {"frame_duration": 2}),
    "kinds of objects": Case("ViewLayer", stages.all_kinds, "use_solid use_volumes use_strand"),
    "child": Case("Object", stages.child, "parent rotation_mode data",
                  {"rotation_euler": (0.1, 0.2, 0.3)},
                  {"parent": "Other", "rotation_mode": "ZYX", "data": "Parent"}),
    "placed child": Case("Object", stages.child, "matrix_world",
                         others={"matrix_world": np.diag((2.0, 3.0, 4.0, 1.0)).tolist()}, stays=True),
    "picture that culls": Case(
        "RenderSettings", stages.culling_output,
        "resolution_x resolution_y pixel_aspect_x pixel_aspect_y use_multiview",
        others={"resolution_x": 4, "resolution_y": 64, "pixel_aspect_x": 20.0, "pixel_aspect_y": 20.0},
        part="instances"),
    "camera that culls": Case("Camera", stages.culling_camera,
                              "clip_start clip_end"),
}  # fmt: skip
POINTERS = {
    **dict.fromkeys(("material", "material_override"), "materials"),
    **dict.fromkeys(("world", "world_override"), "worlds"),
    **dict.fromkeys(("camera", "parent", "focus_object"), "objects"),
    **dict.fromkeys(("instance_collection", "receiver_collection", "blocker_collection"), "collections"),
    "data": "meshes", "background_set": "scenes",
}  # fmt: skip
"""Properties whose other value is a data-block of this list, by name; made if it is absent."""
