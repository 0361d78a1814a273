# SPDX-License-Identifier: GPL-3.0-or-later
"""What F12 gives to the renderer changes with every setting that the ledger lists as read or noted, and with no other.

``test_settings_are_read.py`` walks the settings of single objects; here are those of ``rendered_cases.py``.
"""

from __future__ import annotations

import contextlib
from typing import Any

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.translate.ledger import entries
from tests.blender import own_cases
from tests.blender import test_settings_are_read as objects
from tests.blender.handed_over import handed_over
from tests.blender.rendered_cases import CASES, POINTERS
from tests.settings_walk import because, fingerprint, ignored_settings, other_rna, read_rna


@pytest.fixture
def press(blender: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """What F12 gives to the renderer; a picture of 16×8 pixels."""
    scene = bpy.context.scene
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "SPECTRAL", 16, 8
    return handed_over(monkeypatch)


def made(case: Any, build: Any, folder: Any) -> Any:
    """The struct of a case, in a scene with a camera."""
    owner = case.made(build, folder)
    if bpy.context.scene.camera is None:
        build.camera()
    for setting, value in case.first.items():
        setattr(owner, setting, value)
    return owner


@pytest.mark.parametrize("name", CASES)
def test_every_setting_listed_as_read_changes_what_is_rendered(build, press, tmp_path, name):
    listed = entries()[CASES[name].kind].read | set(entries()[CASES[name].kind].noted)
    assert set(CASES[name].names.split()) <= listed
    walk(CASES[name], build, press, tmp_path)


@pytest.mark.parametrize("name", own_cases.CASES)
def test_every_setting_of_the_extension_changes_what_is_rendered(build, press, tmp_path, name):
    walk(own_cases.CASES[name], build, press, tmp_path)


def walk(case: Any, build: Any, press: Any, tmp_path: Any) -> None:
    """Change each setting of a case in turn."""
    owner = made(case, build, tmp_path)
    names = [each for each in case.names.split() if hasattr(owner, each)]
    assert names

    def write(setting: str, value: Any) -> None:
        setattr(owner, setting, value)
        owner.id_data.update_tag()
        if isinstance(owner.id_data, bpy.types.Image) and owner.id_data.source == "FILE":
            owner.id_data.reload()

    def other(setting: str) -> Any:
        value = case.others.get(setting)
        if setting in POINTERS:
            data = getattr(bpy.data, POINTERS[setting])
            return data.get(value) or data.new(value)
        if setting.startswith("filepath") and value:
            return str(tmp_path / value)
        return other_rna(owner, setting) if value is None else value

    def seen() -> Any:
        given = press()
        return getattr(given[0][0], case.part) if case.part else given

    found = ignored_settings(names, lambda setting: read_rna(owner, setting), write, other, seen)
    assert found == (dict.fromkeys(names, "is not undone") if case.stays else {})


EVALUATED = "Blender evaluates it before the translation"
ALIAS = "another word for a setting that is walked"
OF_A_BONE = "a place on the parent, which Blender evaluates"
OLDER = "of older Blenders, in which things can be without nodes"
NODES = "the structs of nodes: tests/blender/nodes/test_node_settings_are_read.py"


NOT_WALKED: dict[str, dict[str, str]] = {
    **{kind: {"*": NODES} for kind in ["TexMapping", "ColorRamp", "ColorRampElement", "CurveMapping", "CurveMapPoint"]},
    **{kind: {"*": EVALUATED} for kind in ["Curve", "SurfaceCurve", "TextCurve", "MetaBall", "ParticleSettings"]},
    **{kind: because(OLDER, "use_nodes") for kind in ["PointLight", "SpotLight", "SunLight", "AreaLight"]},
    "Material": because(OLDER, "diffuse_color use_nodes"),
    "World": because(OLDER, "color use_nodes"),
    "Camera": because(ALIAS, "angle_x angle_y lens_unit") | because(
        "a camera of type Custom is named as a whole",
        "custom_bytecode custom_bytecode_hash custom_filepath custom_mode custom_shader"),
    "CameraDOFSettings": because("a bone of the focus object: test_focus_on_bones.py", "focus_subtarget"),
    "Mesh": because(ALIAS, "auto_texspace"),
    "Image": because(
        "Blender has loaded the picture", "file_format filepath_raw pixels use_deinterlace use_multiview"),
    "ImageUser": because("of the image editor", "tile"),
    "ColorManagedInputColorspaceSettings": because(ALIAS, "is_data"),
    "SceneRenderView": because("names files, which Blender writes", "file_suffix"),
    "AOV": because("a result", "is_valid"),
    "Volume": because("decide on a note, see test_volume_motion.py", "velocity_grid velocity_scale"),
    "VolumeRender": because("of grids: volumes/test_media.py", "clipping space"),
    "ViewLayer": because("Blender omits the layer, or its picture", "use use_pass_combined"),
    "Object": because(ALIAS, "dimensions matrix_basis matrix_local")
    | because(OF_A_BONE, "parent_bone parent_bone_head_tail_factor parent_type parent_vertices track_axis up_axis "
               "use_parent_final_indices matrix_parent_inverse")
    | because("of another rotation mode", "delta_rotation_quaternion rotation_axis_angle rotation_quaternion"),
    "CyclesMaterialSettings": because("of grids: test_coarse_grids.py", "volume_interpolation"),
    "CyclesObjectSettings": because("older words of the object's own", "shadow_terminator_geometry_offset "
                                     "shadow_terminator_offset"),
    "RenderSettings": because("chooses the engine", "engine") | because(
        EVALUATED, "hair_subdiv hair_type simplify_child_particles simplify_child_particles_render "
        "simplify_subdivision use_simplify_normals") | because("of Blender's file", "use_crop_to_border"),
}  # fmt: skip
"""Settings without a walk, each with its reason; ``*``: all of a type."""


def test_every_setting_listed_as_read_is_walked():
    """Those of nodes are walked by ``test_node_settings_are_read.py``."""
    walked: dict[str, set[str]] = {}
    for case in CASES.values():
        walked.setdefault(case.kind, set()).update(case.names.split())
    for each in objects.CASES.values():
        listed = entries()[each.kind].read | set(entries()[each.kind].noted)
        walked.setdefault(each.kind, set()).update(listed - set(each.besides))
    for kind, entry in entries().items():
        listed = (entry.read | set(entry.noted)) if not kind.startswith("ShaderNode") else set()
        reasons = set(NOT_WALKED.get(kind, {}))
        left = listed - walked.get(kind, set())
        assert (left and reasons == {"*"}) or left == reasons, kind


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if not case.part])
def test_a_setting_listed_as_without_effect_changes_nothing(build, press, tmp_path, name):
    owner = made(CASES[name], build, tmp_path)
    listed = entries()[CASES[name].kind].no_effect
    plain, effects = fingerprint(press()), set()
    for each in owner.bl_rna.properties:
        if each.is_readonly or each.type in ("POINTER", "COLLECTION") or not listed & {each.identifier, "*"}:
            continue
        kept = read_rna(owner, each.identifier)
        with contextlib.suppress(StopIteration, AttributeError):  # a list of one option; a property of another state
            setattr(owner, each.identifier, other_rna(owner, each.identifier))
            owner.id_data.update_tag()
            if fingerprint(press()) != plain:
                effects.add(each.identifier)
            setattr(owner, each.identifier, kept)
            owner.id_data.update_tag()
    assert not effects
