# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing is silent: every setting of this Blender is read, without effect on a picture, or noted."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

WALKED = ("Object", "PointLight", "SpotLight", "SunLight", "AreaLight", "World", "Camera", "CameraDOFSettings",
          "ViewLayer", "LayerCollection", "Scene", "RenderSettings", "Material", "ParticleSettings")  # fmt: skip
CYCLES = ("CyclesRenderSettings", "CyclesMaterialSettings", "CyclesLightSettings", "CyclesWorldSettings",
          "CyclesVisibilitySettings", "CyclesObjectSettings", "CyclesCurveRenderSettings",
          "CyclesRenderLayerSettings")  # fmt: skip
ABSTRACT = {"ShaderNode", "ShaderNodeTree", "ShaderNodeCustomGroup"}


def missing_of(kind, names):
    from blender_addon.translate.ledger import entries

    entry = entries().get(kind)
    return list(names) if entry is None else [name for name in names if not entry.accounts_for(name)]


def settings_of(kind, base):
    """Names that can be set on a type, without those that every ID or node has."""
    common = {each.identifier for each in base.bl_rna.properties}
    return [p.identifier for p in kind.bl_rna.properties if p.identifier not in common and not p.is_readonly]


def cycles_type(name):
    properties = pytest.importorskip("cycles.properties", reason="this Blender has no Cycles")
    return getattr(properties, name)


@pytest.mark.parametrize("name", WALKED)
def test_every_setting_is_accounted_for(blender, name):
    missing = missing_of(name, settings_of(getattr(bpy.types, name), bpy.types.ID))
    # the extension's own settings are read by its own translation
    missing = [each for each in missing if each not in ("spectral", "cycles", "cycles_curves", "cycles_visibility")]
    assert not missing, f"{name}: enter these settings in blender_addon/translate/ledger: {missing}"


@pytest.mark.parametrize("name", CYCLES)
def test_every_setting_of_cycles_is_accounted_for(blender, name):
    missing = missing_of(name, settings_of(cycles_type(name), bpy.types.ID))
    assert not missing, f"{name}: enter these settings in blender_addon/translate/ledger: {missing}"


def test_every_node_setting_and_input_is_accounted_for(blender):
    tree = bpy.data.node_groups.new("every node", "ShaderNodeTree")
    missing = {}
    for name in dir(bpy.types):
        if not name.startswith("ShaderNode") or name in ABSTRACT:
            continue
        node = tree.nodes.new(name)
        names = settings_of(type(node), bpy.types.ShaderNode)
        names += [f"input:{socket.identifier}" for socket in node.inputs]
        if left := missing_of(name, names):
            missing[name] = left
    assert not missing, f"enter these in blender_addon/translate/ledger/nodes.toml: {missing}"


def test_a_setting_that_is_missing_would_be_found(blender):
    assert missing_of("World", ["color", "a setting of tomorrow"]) == ["a setting of tomorrow"]
    assert missing_of("A type of tomorrow", ["anything"]) == ["anything"]


def test_no_entry_is_for_a_name_that_stands_twice(blender):
    from blender_addon.translate.ledger import entries

    for kind, entry in entries().items():
        assert not entry.read & entry.no_effect, kind
        assert not (entry.read | entry.no_effect) & set(entry.noted), kind


def test_what_is_noted_is_named_where_it_is_changed(build, translate):
    material = build.material()
    build.plane(material=material)
    assert not translate().notes
    cycles = bpy.context.scene.cycles
    cycles.film_transparent_glass = True
    bpy.context.view_layer.samples = 7
    tree = material.node_tree
    glass = tree.nodes.new("ShaderNodeBsdfGlass")
    glass.inputs["Thin Film Thickness"].default_value = 300
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(glass.outputs[0], output.inputs["Surface"])
    notes = {(note.subject, note.message.split(";")[0]) for note in translate().notes}
    assert ("Scene", "Transparent Glass is not simulated") in notes
    assert any(message == "samples of a view layer's own are not used" for _, message in notes)
    assert any("thin film is left out" in message for _, message in notes)
