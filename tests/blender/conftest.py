# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender with the extension enabled and an empty scene for each test, and functions that fill the scene."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


@pytest.fixture
def build(blender, builders):
    """Builders of scene parts, linked into an empty scene."""
    return builders


@pytest.fixture(scope="session")
def builders(_extension):
    """Builders of scene parts, linked into the scene that is there."""
    return SimpleNamespace(
        mesh=_mesh, plane=_plane, object=_object, material=_material, light=_light, camera=_camera, image=_image
    )


@pytest.fixture
def translate(blender):
    """The translated scene; adds a camera if the test has added none."""

    def run():
        from blender_addon.translate.scene import translate_scene

        if bpy.context.scene.camera is None:
            _camera()
        return translate_scene(bpy.context.evaluated_depsgraph_get())

    return run


@pytest.fixture
def surface(build, translate):
    """The translated surface of a material on a plane, and the notes."""

    def run(material):
        for each in list(bpy.data.objects):
            bpy.data.objects.remove(each)
        build.plane(material=material)
        scene = translate()
        return scene.materials[0].surface, {note.message for note in scene.notes}

    return run


def _object(name, data, location=(0, 0, 0)):
    made = bpy.data.objects.new(name, data)
    made.location = location
    bpy.context.scene.collection.objects.link(made)
    return made


def _mesh(name, vertices, faces, material=None):
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    if material is not None:
        data.materials.append(material)
    return _object(name, data)


def _plane(name="Plane", size=2.0, material=None):
    half = size / 2
    made = _mesh(
        name, [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [(0, 1, 2, 3)], material
    )
    uvs = made.data.uv_layers.new(name="UVMap")
    uvs.uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], dtype=np.float32))
    return made


def _material(name="Material", shader="ShaderNodeBsdfDiffuse", **inputs):
    """A material with one shader node whose inputs are set by name; ``material["shader"]`` holds the node's name."""
    from blender_addon import compat

    made = bpy.data.materials.new(name)
    tree = compat.use_nodes(made)
    tree.nodes.clear()
    node = tree.nodes.new(shader)
    node.name = "shader"
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return made


def _light(kind, energy=100.0, location=(0, 0, 2), **values):
    data = bpy.data.lights.new(kind.title(), kind)
    data.energy = energy
    for key, value in values.items():
        setattr(data, key, value)
    return _object(kind.title(), data, location)


def _camera(location=(0, 0, 5), **values):
    data = bpy.data.cameras.new("Camera")
    for key, value in values.items():
        setattr(data, key, value)
    made = _object("Camera", data, location)
    bpy.context.scene.camera = made
    return made


def _image(name, pixels, *, float_buffer=False, color_space=None):
    """An image with pixels (h, w, 4) in Blender's row order."""
    array = np.asarray(pixels, dtype=np.float32)
    made = bpy.data.images.new(name, array.shape[1], array.shape[0], alpha=True, float_buffer=float_buffer)
    if color_space:
        made.colorspace_settings.name = color_space
    made.pixels.foreach_set(array.ravel())
    made.update()
    return made


@pytest.fixture(autouse=True)
def _deprecations():
    """Ignore Blender's deprecation warnings for 6.0: ``compat.py`` supports the old and the new interface."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=DeprecationWarning, message=".*expected to be removed in Blender.*")
        yield
