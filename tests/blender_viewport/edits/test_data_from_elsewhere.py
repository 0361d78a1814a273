# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts that read files, texts or settings of other data: a view shows what F12 shows after the next edit."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.contents.test_settings_in_view import outdated  # noqa: E402
from tests.blender_viewport.edits.test_viewport_edits import shader, updated  # noqa: E402

LUMINAIRE = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1.0 3 1 1 2 0 0 0\n1.0 1.0 100\n0 45 90\n0\n{} 80 20\n"


def dimmed(_stage=None):
    """An edit of the lamp's strength, which needs no walk over the objects."""
    bpy.data.lights["Lamp"].energy *= 0.9


def polished(stage):
    """The same of a material."""
    inputs = shader(stage.material)["Roughness"]
    inputs.default_value = 0.9 * inputs.default_value


@pytest.fixture
def translated(monkeypatch):
    """Names of the materials that were translated."""
    from blender_addon.translate import objects

    names, made = [], objects.translate_material
    monkeypatch.setattr(objects, "translate_material", lambda *given: names.append(given[1]) or made(*given))
    return names


def sent(stage):
    return next(iter(stage.link.scenes.values()))


def painted(stage):
    return next(each for each in sent(stage).materials if each.name == "Paint").surface


def read(stage):
    """What the material reads of its mesh."""
    from spectral_core.scene import mesh_inputs_of

    return mesh_inputs_of(painted(stage))


def with_maps(stage):
    """Two UV maps on the ball."""
    data = bpy.data.objects["Ball"].data
    while data.uv_layers:
        data.uv_layers.remove(data.uv_layers[0])
    first, second = data.uv_layers.new(name="First"), data.uv_layers.new(name="Second")
    assert (first.name, second.name) == ("First", "Second")
    data.uv_layers["First"].active_render = True
    return data.uv_layers


@pytest.mark.parametrize("kind", ["NormalMap", "Tangent"])
def test_tangents_follow_the_uv_map_that_renders(stage, kind):
    layers = with_maps(stage)
    for corner, each in enumerate(layers["Second"].uv):
        each.vector = 0.1 * corner, 0.3 * corner * corner
    tree = stage.material.node_tree
    node = tree.nodes.new(f"ShaderNode{kind}")
    if kind == "Tangent":
        node.direction_type = "UV_MAP"
    shader(stage.material)["Anisotropic"].default_value = 0.5
    tree.links.new(node.outputs[0], shader(stage.material)["Normal" if kind == "NormalMap" else "Tangent"])
    updated(stage)
    assert not outdated(stage)[0]
    for name in ("Second", "First"):
        updated(stage, lambda _stage, name=name: setattr(layers[name], "active_render", True))
        assert outdated(stage)[0] == []
    node.uv_map = "First"
    updated(stage)
    assert "attribute_tangent:First" in read(stage) and "attribute_tangent:" not in read(stage)


def test_ambient_occlusion_follows_the_distance_of_the_world(stage, translated):
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    tree = stage.material.node_tree
    node = tree.nodes.new("ShaderNodeAmbientOcclusion")
    node.inputs["Distance"].default_value = 0
    tree.links.new(node.outputs["AO"], shader(stage.material)["Roughness"])
    updated(stage)
    for distance in (0.3, 3.0):
        updated(stage, lambda _stage, distance=distance: setattr(world.light_settings, "distance", distance))
        assert outdated(stage)[0] == []
    translated.clear()
    updated(stage, dimmed)
    assert translated == []


def spectral_texture(stage, path):
    tree = stage.material.node_tree
    node = tree.nodes.new("SpectralSceneTexture")
    node.filepath = str(path)
    tree.links.new(node.outputs["Color"], shader(stage.material)["Base Color"])


def write_texture(path, share):
    from spectral_core.palette.texture.file import write_texture as write
    from spectral_core.palette.texture.reach import TEXTURE_GRID
    from spectral_core.palette.texture.texture import SpectralTexture
    from spectral_core.spectra.catalogue import illuminant

    band = np.clip((TEXTURE_GRID.wavelengths_nm - 520) / 60, 0, 1)
    weights = np.full((2, 5, 4), share, np.float16)
    write(path, SpectralTexture(weights, np.stack([band, 1 - band]), (illuminant("D65"),)))


def test_a_spectral_texture_that_is_written_again_is_shown(stage, tmp_path, translated):
    path = tmp_path / "texture.exr"
    write_texture(path, 0.1)
    updated(stage, lambda stage: spectral_texture(stage, path))
    assert outdated(stage)[0] == []
    for share in (0.4, 0.8):
        write_texture(path, share)
        updated(stage, dimmed)
        assert outdated(stage)[0] == []
        assert float(painted(stage).base_color.weights.max()) == pytest.approx(share, abs=1e-3)
    path.unlink()
    updated(stage, dimmed)
    assert outdated(stage)[0] == []
    write_texture(path, 0.2)
    updated(stage, dimmed)
    assert outdated(stage)[0] == []
    translated.clear()
    updated(stage, dimmed)
    assert translated == []


def luminaire(owner, path=None):
    """An IES node as the strength of a lamp or a material."""
    if owner.node_tree is None:
        owner.use_nodes = True
    tree = owner.node_tree
    node = tree.nodes.new("ShaderNodeTexIES")
    if path is None:
        node.mode, node.ies = "INTERNAL", bpy.data.texts.new("lamp.ies")
        node.ies.write(LUMINAIRE.format(100))
    else:
        node.mode, node.filepath = "EXTERNAL", str(path)
    emission = next((each for each in tree.nodes if each.type == "EMISSION"), None)
    target = shader(owner)["Roughness"] if emission is None else emission.inputs["Strength"]
    tree.links.new(node.outputs[0], target)
    return node


@pytest.mark.parametrize("owner", ["lamp", "material"])
def test_an_edited_text_of_a_luminaire_is_shown(stage, owner):
    data = stage.material if owner == "material" else bpy.data.lights["Lamp"]
    node = luminaire(data)
    updated(stage)
    for first in (50, 70):

        def edit(stage, first=first):
            node.ies.clear()
            node.ies.write(LUMINAIRE.format(first))
            (dimmed if owner == "material" else polished)(stage)

        updated(stage, edit)
        assert outdated(stage)[0] == []


@pytest.mark.parametrize("owner", ["lamp", "material"])
def test_a_written_file_of_a_luminaire_is_shown(stage, owner, tmp_path):
    data, path = stage.material if owner == "material" else bpy.data.lights["Lamp"], tmp_path / "lamp.ies"
    edit = dimmed if owner == "material" else polished
    luminaire(data, path)
    updated(stage)
    for first in (50, 9, None, 70):  # there is no file at first, and for the third time
        if first is None:
            path.unlink()
        else:
            path.write_text(LUMINAIRE.format(first), "ascii")
        updated(stage, edit)
        assert outdated(stage)[0] == []
    table = sent(stage).lights[0].photometry
    assert owner == "material" or float(table.strength.max() / table.strength.min()) == pytest.approx(4.0)
