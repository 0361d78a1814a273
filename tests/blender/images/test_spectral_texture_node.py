# SPDX-License-Identifier: GPL-3.0-or-later
"""The node Spectral Texture: the renderer gets its file as reflectances, Blender's other views show its picture."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.palette.texture.file import write_texture
from spectral_core.palette.texture.reach import TEXTURE_GRID
from spectral_core.palette.texture.texture import SpectralTexture
from spectral_core.scene import SpectralImage
from spectral_core.spectra.catalogue import illuminant, reflectance

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


def store_spectrum(holder, spectrum):
    from blender_addon.translate.spectra.stored import store_spectrum as store

    store(holder, spectrum)


@pytest.fixture
def texture(tmp_path):
    band = np.clip((TEXTURE_GRID.wavelengths_nm - 520) / 60, 0, 1)
    weights = np.linspace(0, 1, 2 * 5 * 4).reshape(2, 5, 4).astype(np.float16)
    made = SpectralTexture(weights, np.stack([band, 1 - band]), (illuminant("D65"),))
    write_texture(tmp_path / "texture.exr", made)
    return made, tmp_path / "texture.exr"


@pytest.fixture
def node(build):
    material = build.material()
    made = material.node_tree.nodes.new("SpectralSceneTexture")
    material.node_tree.links.new(made.outputs["Color"], material.node_tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    return made


def test_its_file_reaches_the_renderer(texture, node, translate):
    made, path = texture
    node.filepath = str(path)
    node.extension, node.interpolation = "MIRROR", "Closest"
    scene = translate()
    found = scene.materials[0].surface.color
    assert isinstance(found, SpectralImage)
    np.testing.assert_array_equal(found.weights, made.weights[:, ::-1])
    np.testing.assert_array_equal(found.spectra, made.spectra)
    assert (found.extension, found.interpolation) == ("mirror", "nearest")
    assert not [note for note in scene.notes if "Spectral Texture" in note.message]


def test_its_pixels_are_at_their_uv_coordinates(node, texture, translate):
    node.filepath = str(texture[1])
    (mesh,) = translate().meshes
    np.testing.assert_allclose(mesh.uvs, mesh.positions[:, :2] / mesh.positions[:, :2].max() / 2 + 0.5, atol=1e-6)


def test_blender_shows_its_picture_and_copies_have_separate_data(texture, node):
    path = texture[1]
    node.filepath = str(path)
    image = next(inner for inner in node.node_tree.nodes if inner.bl_idname == "ShaderNodeTexImage").image
    assert tuple(image.size) == (4, 5)
    assert node.message == ""
    copy = node.id_data.nodes.new("SpectralSceneTexture")
    assert copy.node_tree != node.node_tree
    node.filepath = "/nowhere/texture.exr"
    assert "there is no file" in node.message


@pytest.mark.parametrize("path", ["", "/nowhere/texture.exr"])
def test_a_missing_file_gets_one_note(node, translate, path):
    node.filepath = path
    notes = [note.message for note in translate().notes if "Spectral Texture" in note.message]
    assert len(notes) == 1
    assert "a neutral gray was used" in notes[0]


def test_a_color_node_works_on_its_picture(texture, node, translate):
    node.filepath = str(texture[1])
    tree = node.id_data
    inverted = tree.nodes.new("ShaderNodeInvert")
    tree.links.new(node.outputs["Color"], inverted.inputs["Color"])
    tree.links.new(inverted.outputs["Color"], tree.nodes["shader"].inputs["Color"])
    scene = translate()
    assert any("the node used its color instead" in note.message for note in scene.notes)


def test_its_spectra_have_precedence_over_the_spectrum_of_its_material(texture, node, translate):
    node.filepath = str(texture[1])
    store_spectrum(bpy.data.materials[0].spectral, reflectance("yellow"))
    scene = translate()
    assert isinstance(scene.materials[0].surface.color, SpectralImage)
    assert not [note for note in scene.notes if "replaces the texture" in note.message]


def test_a_spectrum_that_replaces_an_image_gets_a_note(build, translate):
    material = build.material()
    made = material.node_tree.nodes.new("ShaderNodeTexImage")
    made.image = build.image("photo", np.ones((2, 2, 4), np.float32))
    material.node_tree.links.new(made.outputs["Color"], material.node_tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    assert not [note for note in translate().notes if "replaces the texture" in note.message]
    store_spectrum(material.spectral, reflectance("yellow"))
    scene = translate()
    assert scene.materials[0].surface.color.name == "yellow"
    assert len([note for note in scene.notes if "replaces the texture" in note.message]) == 1


def test_its_picture_is_repeated_and_filtered_as_the_texture(texture, node) -> None:
    node.extension = "MIRROR"
    node.filepath = str(texture[1])
    shown = next(inner for inner in node.node_tree.nodes if inner.bl_idname == "ShaderNodeTexImage")
    assert (shown.extension, shown.interpolation) == ("MIRROR", "Linear")
    node.extension, node.interpolation = "EXTEND", "Closest"
    assert (shown.extension, shown.interpolation) == ("EXTEND", "Closest")
