# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra stored on Blender data: from every source, through save, load, append and undo."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.translate.spectra import stored as properties
from spectral_core.errors import InvalidInputError
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid


def paint(name: str = "paint", seed: int = 0) -> Reflectance:
    grid = SpectralGrid.uniform()
    return Reflectance(name, grid, np.random.default_rng(seed).uniform(0, 1, grid.size))


def assert_same(stored, wanted) -> None:
    assert type(stored) is type(wanted)
    np.testing.assert_allclose(stored.grid.wavelengths_nm, wanted.grid.wavelengths_nm, rtol=1e-6)
    np.testing.assert_allclose(stored.values, wanted.values, rtol=1e-6, atol=1e-7)


def test_nothing_is_stored_until_a_source_is_chosen(blender):
    material = blender.data.materials.new("plain")
    assert properties.spectrum_of(material) is None
    assert properties.strength_of(material) == 1.0


@pytest.mark.parametrize("typed", ["D65", "sodium", "blackbody 3200"])
def test_light_from_the_catalogue(blender, typed):
    light = blender.data.lights.new("key", "POINT")
    light.spectral.source = "CATALOGUE"
    light.spectral.catalogue_name = typed
    assert light.spectral.message == ""
    assert_same(properties.spectrum_of(light), catalogue.illuminant(typed))


def test_materials_worlds_and_nodes_have_the_right_type_of_spectrum(blender):
    material, world = blender.data.materials.new("m"), blender.data.worlds.new("w")
    material.spectral.source = "CATALOGUE"
    material.spectral.catalogue_name = "dark skin"
    assert_same(properties.spectrum_of(material), catalogue.reflectance("dark skin"))
    world.spectral.source = "CATALOGUE"
    world.spectral.catalogue_name = "A"
    assert isinstance(properties.spectrum_of(world), Illuminant)
    emission = material.node_tree.nodes.new("ShaderNodeEmission")
    emission.spectral.source = "CATALOGUE"
    emission.spectral.catalogue_name = "HP1"
    assert_same(properties.spectrum_of(emission), catalogue.illuminant("HP1"))


@pytest.mark.parametrize("interpolation", ["linear", "sampled"])
def test_the_interpolation_of_a_spectrum_is_kept(blender, interpolation):
    grid = SpectralGrid(np.linspace(400, 700, 7), interpolation)
    lamp = blender.data.lights.new("lamp", "POINT")
    properties.store_spectrum(lamp.spectral, Illuminant("mine", grid, np.linspace(0.1, 0.7, 7)))
    assert properties.spectrum_of(lamp).grid.interpolation == interpolation


def test_strength_counts_only_with_a_spectrum_and_is_reset_with_another(blender):
    light = blender.data.lights.new("key", "POINT")
    light.spectral.strength = 3.0
    assert properties.strength_of(light) == 1.0
    light.spectral.source = "CATALOGUE"
    light.spectral.catalogue_name = "A"
    light.spectral.strength = 2.0
    assert properties.strength_of(light) == 2.0
    light.spectral.catalogue_name = "D65"
    assert properties.strength_of(light) == 1.0


def test_an_unknown_name_is_reported_and_not_replaced(blender):
    light = blender.data.lights.new("key", "POINT")
    light.spectral.source = "CATALOGUE"
    light.spectral.catalogue_name = "HP9"
    assert "no illuminant is named 'HP9'" in light.spectral.message
    with pytest.raises(InvalidInputError, match="no illuminant is named 'HP9'; did you mean"):
        properties.spectrum_of(light)


def test_a_wrong_source_removes_the_earlier_spectrum(blender):
    light = blender.data.lights.new("key", "POINT")
    light.spectral.source = "CATALOGUE"
    light.spectral.catalogue_name = "D65"
    light.spectral.catalogue_name = "D66"
    with pytest.raises(InvalidInputError, match="'D66'"):
        properties.spectrum_of(light)


def test_the_source_designed_without_a_design_names_the_remedy(blender):
    material = blender.data.materials.new("m")
    material.spectral.source = "DESIGNED"
    with pytest.raises(InvalidInputError, match="nothing is designed yet; take a spectrum from the palette"):
        properties.spectrum_of(material)
    material.spectral.source = "NONE"
    assert properties.spectrum_of(material) is None


def test_designed_values_are_kept_by_save_load_and_append(blender, tmp_path):
    material = blender.data.materials.new("mark")
    properties.store_spectrum(material.spectral, paint())
    node = material.node_tree.nodes.new("ShaderNodeRGB")
    node.name = "tint"
    properties.store_spectrum(node.spectral, paint("tint", seed=1))
    material.use_fake_user = True
    file = str(tmp_path / "scene.blend")
    blender.ops.wm.save_as_mainfile(filepath=file)
    blender.ops.wm.open_mainfile(filepath=file)
    loaded = blender.data.materials["mark"]
    assert loaded.spectral.source == "DESIGNED"
    assert_same(properties.spectrum_of(loaded), paint())
    assert_same(properties.spectrum_of(loaded.node_tree.nodes["tint"]), paint(seed=1))

    blender.ops.wm.read_factory_settings(use_empty=True)
    with blender.data.libraries.load(file) as (_, wanted):
        wanted.materials = ["mark"]
    assert_same(properties.spectrum_of(wanted.materials[0]), paint())


def test_undo_restores_the_earlier_spectrum(blender):
    blender.data.materials.new("mark").use_fake_user = True
    properties.store_spectrum(blender.data.materials["mark"].spectral, paint(seed=1))
    blender.ops.ed.undo_push(message="first")
    properties.store_spectrum(blender.data.materials["mark"].spectral, paint(seed=2))
    blender.ops.ed.undo_push(message="second")
    blender.ops.ed.undo()
    assert_same(properties.spectrum_of(blender.data.materials["mark"]), paint(seed=1))
    blender.ops.ed.redo()
    assert_same(properties.spectrum_of(blender.data.materials["mark"]), paint(seed=2))


def test_a_light_is_never_negative(blender):
    light = blender.data.lights.new("key", "SUN")
    grid = SpectralGrid.uniform()
    from spectral_core.spectra.spectrum import Spectrum

    with pytest.raises(InvalidInputError, match="light's power is at least 0"):
        properties.store_spectrum(light.spectral, Spectrum("bad", grid, np.full(grid.size, -1.0)))
    assert properties.spectrum_of(light) is None
