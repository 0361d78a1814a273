# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation and rendering of fluorescent dyes from the palette or from the material's panel."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.scene import Fluorescent, leaves
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba")


def dye(material, taken=405.0, sent=530.0, amount=0.3):
    made = material.spectral.dyes.add()
    made.excitation_nm, made.emission_nm, made.amount = taken, sent, amount


def fluorescent(scene, name):
    material = next(material for material in scene.materials if material.name == name)
    return [leaf for leaf in leaves(material.surface) if isinstance(leaf, Fluorescent)]


def test_dyes_of_a_material_reach_its_diffuse_and_principled_shaders(build, translate):
    plain = build.material("Plain", Color=(0.3, 0.3, 0.3, 1.0))
    glossy = build.material("Glossy", "ShaderNodeBsdfPrincipled", Metallic=0.25)
    for material in (plain, glossy):
        dye(material)
        build.plane(material=material)
    scene = translate()
    (own,) = fluorescent(scene, "Plain")
    assert [d.name for d in own.dyes] == ["dye 405 to 530 nm"]
    assert own.amounts == (pytest.approx(0.3),)
    np.testing.assert_allclose(own.color.linear_rgb, 0.3, rtol=1e-6)
    (base,) = fluorescent(scene, "Glossy")
    assert not base.color.linear_rgb.any()
    assert 0.1 < base.amounts[0] < 0.3 * 0.93  # less light below gloss; gray 0.8 limits it
    assert any("reduced to" in note.message for note in scene.notes if note.subject == "Glossy")


def test_every_number_of_a_dye_changes_its_bells(build):
    from blender_addon.translate.shading.carried.dyes import dyes_of

    material = build.material("Paint")
    dye(material)
    own = material.spectral.dyes[0]

    def peaks():
        (found,), _ = dyes_of(material)
        return [each.grid.wavelengths_nm[np.argmax(each.values)] for each in (found.excitation, found.emission)]

    assert peaks() == pytest.approx([405.0, 530.0], abs=2.0)
    own.excitation_nm, own.emission_nm, own.amount = 425.0, 570.0, 0.2
    assert peaks() == pytest.approx([425.0, 570.0], abs=2.0)
    assert dyes_of(material)[1] == (pytest.approx(0.2),)


# Fresnel's reflectance of an index of 1.5 over all directions is 0.0918 (Walsh 1926). Of a tint of 0.25, 0.5 is left on
# each way straight through, and 0.453 over the directions of even light. Balls of sheen in Cycles reflect 0.446 of it.
@pytest.mark.parametrize(
    ("values", "share"),
    [
        ({}, 0.9082),
        ({"Specular IOR Level": 0.0}, 1.0),
        ({"Coat Weight": 1.0}, 0.9082**2),
        ({"Coat Weight": 1.0, "Coat Tint": (0.25, 0.25, 0.25, 1.0)}, 0.9082**2 * 0.453**2),
        ({"Sheen Weight": 1.0, "Sheen Roughness": 1.0}, 0.9082 * 0.554),
        ({"Thin Film Thickness": 5000.0, "Thin Film IOR": 1.5}, 0.9082),
    ],
    ids=["gloss", "no gloss", "coat", "tinted coat", "sheen", "film of the same index"],
)
def test_layers_of_principled_take_light_from_its_dyes(build, translate, values, share):
    """Coat and sheen took nothing: under sheen a surface returned 1.04 of the light, and tinted coats had no effect."""
    material = build.material("Paint", "ShaderNodeBsdfPrincipled")
    for name, value in {"Base Color": (0.0, 0.0, 0.0, 1.0), **values}.items():
        material.node_tree.nodes["shader"].inputs[name].default_value = value
    dye(material)
    build.plane(material=material)
    (base,) = fluorescent(translate(), "Paint")
    # the tint takes its share of the excitation from the dye's own spectrum
    taken = base.dyes[0].excitation.values.max() / 0.995
    assert base.amounts[0] * taken == pytest.approx(0.3 * share, rel=0.03)


def test_a_colored_coat_hides_dyes_whose_light_it_absorbs(build, translate):
    amounts = {}
    for name, tint in (("Green", (0.05, 1.0, 0.05, 1.0)), ("Red", (1.0, 0.05, 0.05, 1.0))):
        material = build.material(name, "ShaderNodeBsdfPrincipled")
        for socket, value in (("Base Color", (0.0, 0.0, 0.0, 1.0)), ("Coat Weight", 1.0), ("Coat Tint", tint)):
            material.node_tree.nodes["shader"].inputs[socket].default_value = value
        dye(material)  # emits at 530 nm
        build.plane(material=material)
    scene = translate()
    for name in ("Green", "Red"):
        amounts[name] = fluorescent(scene, name)[0].amounts[0]
    assert amounts["Red"] < 0.5 * amounts["Green"]


def test_impossible_dyes_get_a_note(build, translate):
    backwards = build.material("Backwards")
    dye(backwards, 600.0, 450.0)
    mirror = build.material("Mirror", "ShaderNodeBsdfAnisotropic")
    dye(mirror)
    for material in (backwards, mirror):
        build.plane(material=material)
    notes = [(note.subject, note.message) for note in translate().notes]
    assert any(who == "Backwards" and "shown without its dyes" in what for who, what in notes)
    assert any(who == "Mirror" and "no Diffuse or Principled shader" in what for who, what in notes)


def test_the_operator_of_the_panel(build):
    material = build.material("Paint")
    bpy.context.view_layer.objects.active = build.plane(material=material)
    bpy.ops.spectral.material_dye()
    bpy.ops.spectral.material_dye()
    assert [round(each.amount, 3) for each in material.spectral.dyes] == [0.3, 0.3]
    bpy.ops.spectral.material_dye(index=0)
    assert len(material.spectral.dyes) == 1
    with pytest.raises(RuntimeError, match="there is no dye 4; there are 1"):
        bpy.ops.spectral.material_dye(index=4)


def test_a_designed_dye_renders_in_the_color_of_the_palette(build, tmp_path):
    """Oracle: the cell's color in the palette, a sum over the bispectral matrix."""
    from blender_addon import jobs

    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    scene = bpy.context.scene
    palette = scene.spectral.palette
    palette.active_row = 0
    bpy.ops.spectral.palette_dye()
    palette.materials[0].dyes[0].excitation_nm, palette.materials[0].dyes[0].emission_nm = 440, 530
    palette.grid_start, palette.grid_stop, palette.grid_samples = 360, 720, 37
    palette.lights[0].design = palette.lights[1].design = "MEASURED"
    palette.level_to = "LIGHTS"
    for row in palette.materials:
        for cell in row.cells:
            cell.mode = "IGNORE"
    asked = palette.materials[0].cells[1]
    asked.mode, asked.target = "FIXED", (0.3, 1.0, 0.2)  # a green that no reflectance can have in daylight
    bpy.ops.spectral.palette_solve()
    assert palette.materials[0].dyes[0].amount > 1e-3, "the design uses no dye, so the test shows nothing"
    material = build.material("Paint")
    build.plane(size=4.0, material=material)
    palette.materials[0].material = material
    scene.world = bpy.data.worlds.new("World")
    bpy.ops.spectral.palette_apply()
    assert [each.amount for each in material.spectral.dyes] == [palette.materials[0].dyes[0].amount]
    from blender_addon.translate.spectra.stored import spectrum_of, store_spectrum

    store_spectrum(scene.world.spectral, spectrum_of(palette.lights[1], "result"))
    build.camera(type="ORTHO", ortho_scale=1.0)
    scene.render.engine = "SPECTRAL"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.spectral.render.samples = 256
    scene.render.filepath = str(tmp_path / "frame.png")
    bpy.ops.render.render(write_still=True)
    result = jobs.records[-1].result
    assert result is not None and result.plan["fluorescence"].value == "on"
    found = result.pixels[..., :3].reshape(-1, 3).mean(axis=0)
    expected = np.array(asked.actual_linear)
    expected = expected * found.sum() / expected.sum()  # the world's strength is the test's own
    assert float(delta_e_2000(*(lab_from_linear_rgb(rgb) for rgb in (found, expected)))) < 0.5


def test_a_dye_outside_of_the_wavelengths_of_its_spectrum_gets_a_note(build, translate):
    """It was hardly excited without a word; one whose rest was above its emission ended the translation in an error."""
    from blender_addon.translate.spectra.stored import store_spectrum
    from spectral_core.spectra.spectrum import Reflectance, SpectralGrid

    for name, taken, sent in (("Violet", 365.0, 450.0), ("Close", 390.0, 402.0), ("Inside", 460.0, 560.0)):
        material = build.material(name, Color=(0.3, 0.3, 0.3, 1.0))
        dye(material, taken, sent)
        store_spectrum(material.spectral, Reflectance(name, SpectralGrid.uniform(410, 700, 10), np.full(30, 0.3)))
        build.plane(material=material)
    scene = translate()
    notes = [(note.subject, note.message) for note in scene.notes]
    assert any(who == "Violet" and "mainly outside of the wavelengths" in what for who, what in notes)
    assert any(who == "Close" and "410 to 700 nm" in what for who, what in notes)
    assert not any(who == "Inside" for who, _ in notes)
    assert [len(fluorescent(scene, name)[0].dyes) for name in ("Close", "Inside")] == [0, 1]
