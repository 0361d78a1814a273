# SPDX-License-Identifier: GPL-3.0-or-later
"""A view follows a script that sets a property of the extension, without another report of the edit.

The evaluated copy of a data-block is out of date as well if Blender does not report a change. So a view is compared
with a translation of data that are evaluated again, as F12 does.
"""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.contents.test_settings_in_view import outdated  # noqa: E402
from tests.blender_viewport.edits.test_viewport_edits import updated  # noqa: E402

LAMP_NAMES, SURFACE_NAMES = ("HP1", "FL11"), ("blue sky", "foliage")


def colored_by_node(tree, kind, socket):
    """A Color node of a tree that gives the color of its first shader of a kind."""
    node = tree.nodes.new("ShaderNodeRGB")
    shader = next(each for each in tree.nodes if each.type == kind)
    tree.links.new(node.outputs[0], shader.inputs[socket])
    return node


def in_group(material):
    """A Color node in a node group of a material."""
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    inner, end = group.nodes.new("ShaderNodeRGB"), group.nodes.new("NodeGroupOutput")
    group.links.new(inner.outputs[0], end.inputs[0])
    holder = material.node_tree.nodes.new("ShaderNodeGroup")
    holder.node_tree = group
    shader = next(each for each in material.node_tree.nodes if each.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(holder.outputs[0], shader.inputs["Base Color"])
    return inner


def carrier(stage, name):
    if name == "light":
        return bpy.data.lights["Lamp"]
    if name == "world":
        stage.scene.world = stage.scene.world or bpy.data.worlds.new("World")
        return stage.scene.world
    if name == "material":
        shader = next(each for each in stage.material.node_tree.nodes if each.type == "BSDF_PRINCIPLED")
        shader.inputs["Transmission Weight"].default_value = 0.5  # its index of refraction counts
        return stage.material
    if name == "node":
        return colored_by_node(stage.material.node_tree, "BSDF_PRINCIPLED", "Base Color")
    return in_group(stage.material)


def edits(spectral, path, names):
    """Each property of a spectrum in turn, with a script's edit of it; first those that read other values."""
    first, second = names

    def to(**settings):
        return [
            (name, lambda name=name, value=value: setattr(spectral, name, value)) for name, value in settings.items()
        ]

    def sample(name, value):
        return f"samples.{name}", lambda: setattr(spectral.samples[1], name, value)

    yield from (*to(source="CATALOGUE"), *to(catalogue_name=first), *to(catalogue_name=second), *to(strength=0.5))
    yield from (*to(catalogue_name="of nothing"), *to(catalogue_name=first))
    yield from (*to(source="FILE"), *to(filepath=str(path)), *to(file_entry="b"), *to(file_entry="a"))
    yield from (*to(source="DESIGNED"), sample("value", 0.25), sample("wavelength_nm", 450.0))
    yield from (*to(interpolation="SAMPLED"), *to(spectrum_name="Renamed"), *to(origin="a script"))
    yield from (*to(kind="ILLUMINANT"), *to(kind="REFLECTANCE"), *to(kind="OWNER"))
    yield "dyes", lambda: setattr(spectral.dyes.add(), "amount", 0.5)
    for name, value in (("amount", 0.2), ("excitation_nm", 380.0), ("emission_nm", 620.0)):
        yield f"dyes.{name}", lambda name=name, value=value: setattr(spectral.dyes[0], name, value)
    values = (("source", "ABBE"), ("abbe_number", 25.0), ("source", "NAMED"), ("material", "DIAMOND"))
    for name, value in values:
        yield f"dispersion.{name}", lambda name=name, value=value: setattr(spectral.dispersion, name, value)
    yield from to(source="NONE")


@pytest.mark.parametrize("name", ("light", "world", "material", "node", "node in a group"))
def test_each_property_of_a_spectrum(stage, tmp_path, name):
    from blender_addon.properties.spectrum import SpectralSpectrum

    path = tmp_path / "two.csv"
    path.write_text("wavelength,a,b\n400,0.1,0.9\n500,0.5,0.4\n700,0.8,0.1\n", encoding="utf-8")
    owner = carrier(stage, name)
    updated(stage)
    stale, seen = [], set()
    for edited, edit in edits(owner.spectral, path, LAMP_NAMES if name in ("light", "world") else SURFACE_NAMES):
        updated(stage, lambda _stage, edit=edit: edit())
        seen.add(edited.partition(".")[0])
        if outdated(stage, owner.id_data)[0]:
            stale.append(edited)
            updated(stage, lambda _stage: owner.id_data.update_tag())
    assert stale == []
    assert seen == SpectralSpectrum.__annotations__.keys() - {"message"}


def test_overrides_of_the_plan(stage):
    updated(stage)
    settings = stage.scene.spectral.render

    def add(_stage):
        override = settings.overrides.add()
        override.name, override.value = "bounces", "4"

    edits = (add, lambda _stage: setattr(settings.overrides[0], "value", "2"))
    stale = []
    for number, edit in enumerate(edits):
        updated(stage, edit)
        stale += [number for _part in outdated(stage, stage.scene)[0]]
    assert stale == []
    assert next(iter(stage.link.scenes.values())).settings.overrides == (("bounces", "2"),)
