# SPDX-License-Identifier: GPL-3.0-or-later
"""Dispersion of a material in Blender: its indices, its notes, and its colors compared with Snell's law."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.scene import leaves, nominal_ior
from spectral_core.spectra.refraction import NAMED_INDICES, named_index
from spectral_core.spectra.spectrum import Spectrum

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba")


def surfaces(scene, name):
    return list(leaves(next(each for each in scene.materials if each.name == name).surface))


def test_the_choices_of_the_panel_are_those_of_the_core():
    from blender_addon.properties.spectrum import CLEAR_MATERIALS

    assert [item[0] for item in CLEAR_MATERIALS] == list(NAMED_INDICES)
    for name, _, text, _ in CLEAR_MATERIALS:
        at_d, at_f, at_c = NAMED_INDICES[name].at(np.array([587.5618, 486.1327, 656.2725]))
        assert f"Index {at_d:.3f}, Abbe number {(at_d - 1) / (at_f - at_c):.0f}" in text


def test_glass_and_transmission_get_the_index_of_the_dispersion(build, translate):
    glass = build.material("Pane", "ShaderNodeBsdfGlass", IOR=1.6)
    clear = build.material("Clear", "ShaderNodeBsdfPrincipled", IOR=1.4, **{"Transmission Weight": 1.0})
    refraction = build.material("Lens", "ShaderNodeBsdfRefraction", IOR=1.3)
    for material, number in ((glass, 30.0), (clear, 60.0)):
        material.spectral.dispersion.source, material.spectral.dispersion.abbe_number = "ABBE", number
    refraction.spectral.dispersion.source, refraction.spectral.dispersion.material = "NAMED", "DIAMOND"
    for material in (glass, clear, refraction):
        build.plane(material=material)
    scene = translate()
    for name, at_d, number in (("Pane", 1.6, 30.0), ("Clear", 1.4, 60.0)):
        (leaf,) = surfaces(scene, name)
        assert isinstance(leaf.ior, Spectrum)
        blue, yellow, red = leaf.ior.at([486.1327, 587.5618, 656.2725])
        assert yellow == pytest.approx(at_d, abs=1e-4)
        assert (yellow - 1) / (blue - red) == pytest.approx(number, rel=3e-3)
    (lens,) = surfaces(scene, "Lens")
    np.testing.assert_array_equal(lens.ior.values, named_index("DIAMOND").values)
    assert not [note for note in scene.notes if "dispersion" in note.message]


def test_without_dispersion_the_index_is_one_number(build, translate):
    build.plane(material=build.material("Pane", "ShaderNodeBsdfGlass", IOR=1.6))
    (leaf,) = surfaces(translate(), "Pane")
    assert leaf.ior == pytest.approx(1.6)


def test_notes_say_where_dispersion_cannot_be(build, translate):
    paint = build.material("Paint", Color=(0.3, 0.3, 0.3, 1.0))
    opaque = build.material("Opaque", "ShaderNodeBsdfPrincipled")
    varying = build.material("Varying", "ShaderNodeBsdfGlass")
    tree = varying.node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    node = next(each for each in tree.nodes if each.type == "BSDF_GLASS")
    tree.links.new(noise.outputs[0], node.inputs["IOR"])
    smoke = build.material("Smoke", "ShaderNodeVolumeAbsorption")
    tree = smoke.node_tree
    end = next(each for each in tree.nodes if each.type == "OUTPUT_MATERIAL")
    tree.links.remove(end.inputs["Surface"].links[0])
    tree.links.new(tree.nodes["shader"].outputs[0], end.inputs["Volume"])
    for material in (paint, opaque, varying, smoke):
        material.spectral.dispersion.source = "ABBE"
        build.plane(material=material)
    notes = {note.subject: note.message for note in translate().notes if "dispersion" in note.message}
    assert set(notes) == {"Paint", "Opaque", "Varying", "Smoke"}
    assert "no Glass" in notes["Paint"] and "unlink IOR" in notes["Varying"]
    varying.spectral.dispersion.source = "NAMED"  # its index replaces the varying one
    (leaf,) = surfaces(translate(), "Varying")
    assert nominal_ior(leaf.ior) == pytest.approx(1.62, abs=1e-3)


def test_a_shader_of_a_bubble_in_a_named_material_has_the_inverse_index(build, translate):
    """It had the material's index, so that a bubble in water was a ball of water."""
    bubble = build.material("Bubble", "ShaderNodeBsdfGlass", IOR=1 / 1.33)
    bubble.spectral.dispersion.source, bubble.spectral.dispersion.material = "NAMED", "WATER"
    build.plane(material=bubble)
    (leaf,) = surfaces(translate(), "Bubble")
    np.testing.assert_allclose(leaf.ior.values * named_index("WATER").values, 1.0, rtol=1e-12)


def test_gloss_above_dyes_has_the_index_of_the_dispersion(build, translate):
    """Dyes below diamond were as bright as below the shader's index of 1.5: by a fifth too bright."""
    from spectral_core.scene import Fluorescent

    amounts = {}
    for name, index in (("Named", 1.5), ("Plain", 2.4175)):
        material = build.material(name, "ShaderNodeBsdfPrincipled", IOR=index, **{"Transmission Weight": 0.5})
        material.node_tree.nodes["shader"].inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
        material.spectral.dyes.add().amount = 0.3
        build.plane(material=material)
    named = bpy.data.materials["Named"].spectral.dispersion
    named.source, named.material = "NAMED", "DIAMOND"
    scene = translate()
    for name in ("Named", "Plain"):
        (dyed,) = (leaf for leaf in surfaces(scene, name) if isinstance(leaf, Fluorescent))
        amounts[name] = dyed.amounts[0]
    assert amounts["Named"] == pytest.approx(amounts["Plain"], rel=1e-3)


@pytest.mark.parametrize("index", [0.0, 1000.0])
def test_extreme_indices_stay_within_the_limits_of_a_shader(build, translate, index):
    """An Abbe number moved them beyond, and the object was left out of the picture."""
    glass = build.material("Glass", "ShaderNodeBsdfGlass", IOR=index)
    glass.spectral.dispersion.source, glass.spectral.dispersion.abbe_number = "ABBE", 5.0
    build.plane(material=glass)
    scene = translate()
    (leaf,) = surfaces(scene, "Glass")
    assert isinstance(leaf.ior, Spectrum) and len(scene.instances) == 1
