# SPDX-License-Identifier: GPL-3.0-or-later
"""Previews have few samples and no record; a look shows lamps alone, or with another spectrum at equal brightness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.still import render_scene
from spectral_core.scene import Color, Diffuse, Emission, Film, Material, PointLight, World, gray
from spectral_core.scene.look import Look
from spectral_core.spectra import catalogue

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba")


@pytest.fixture
def scene(stage):
    from blender_addon.translate.scene import translate_scene

    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 8)
    stage.scene.collection.objects.link(camera)
    stage.scene.camera = camera
    bpy.context.view_layer.update()
    made = translate_scene(bpy.context.evaluated_depsgraph_get(), film=Film(16, 12, samples=64))
    glow = Material("Glow", Emission(gray(1.0), 2.0))
    instances = tuple(replace(x, materials=("Glow",)) if x.name == "Ball" else x for x in made.instances)
    second = PointLight(name="Second", world_from_light=np.eye(4), power_w=10.0, group="Side")
    return replace(made, materials=(*made.materials, glow), instances=instances, lights=(*made.lights, second))


def test_lamps_alone(scene):
    alone = Look(lamps=frozenset({"Lamp"})).on(scene)
    assert [light.name for light in alone.lights] == ["Lamp"]
    assert alone.world.is_black
    ball = next(x for x in alone.instances if x.name == "Ball")
    material = next(m for m in alone.materials if m.name == ball.materials[0])
    assert material.surface.strength == 0
    assert next(m for m in alone.materials if m.name == "Glow").surface.strength == 2
    group = Look(group="Side").on(scene)
    assert [light.name for light in group.lights] == ["Second"]


def test_a_lamp_of_the_catalogue_is_as_bright_and_has_its_color(scene):
    sodium = catalogue.illuminant("HP1")
    white = replace(
        scene,
        materials=tuple(replace(m, surface=Diffuse(gray(0.7))) for m in scene.materials),
        world=World(gray(0.0), 0.0),
    )
    day, night = (render_scene(look.on(white)).pixels[..., :3] for look in (Look(), Look(spectrum=sodium)))
    luminance = np.array([0.2126, 0.7152, 0.0722])
    assert (night @ luminance).mean() == pytest.approx((day @ luminance).mean(), rel=0.02)
    assert night[..., 0].mean() > 2 * night[..., 2].mean()
    adapted = night @ Look(spectrum=sodium, adapts=True).picture_matrix.T
    assert np.ptp(adapted.mean(axis=(0, 1))) < 0.1 * adapted.mean()
    assert Look(exposure_stops=1.0).picture_matrix == pytest.approx(2 * np.eye(3))


def test_a_look_with_an_unknown_name_lists_the_known_ones(stage):
    from blender_addon.translate.viewport.look import look_of
    from spectral_core.errors import InvalidInputError, UnknownNameError

    settings = stage.scene.spectral.viewport.look
    assert look_of(settings, stage.scene).is_plain
    settings.kind, settings.column = "COLUMN", "Moon"
    with pytest.raises(InvalidInputError, match="no light 'Moon'"):
        look_of(settings, stage.scene)
    settings.kind, settings.lamp = "LAMP", "no such lamp"
    with pytest.raises(UnknownNameError, match="no such lamp"):
        look_of(settings, stage.scene)
    settings.lamp = "HP1"
    assert look_of(settings, stage.scene).spectrum.name == catalogue.illuminant("HP1").name


def test_a_preview_has_few_samples_and_no_notes(stage, scene):
    from blender_addon import jobs
    from blender_addon.engine import SpectralRenderEngine
    from blender_addon.translate.viewport.look import PREVIEW_SAMPLES, preview_scene

    assert SpectralRenderEngine.bl_use_preview
    made = preview_scene(replace(scene, notes=scene.notes), bpy.data.window_managers)
    assert made.film.samples == PREVIEW_SAMPLES
    assert made.notes == ()
    before, seen = len(jobs.records), []
    small = replace(made, film=Film(8, 8, samples=4), materials=tuple(
        replace(m, surface=Diffuse(Color([0.5, 0.2, 0.1]))) for m in made.materials
    ))  # fmt: skip
    result = jobs.render_preview(small, seen.append, lambda: False)
    assert result.status == "done"
    assert seen
    assert len(jobs.records) == before
    while jobs._previews:
        jobs._previews.pop().close()


def test_another_lamp_for_previews_renews_those_that_exist(blender):
    shown, other = bpy.data.materials.new("Shown"), bpy.data.materials.new("Other")
    lamp, world = bpy.data.lights.new("Lamp", "POINT"), bpy.data.worlds.new("World")
    for block in (shown, lamp, world):
        block.preview_ensure()
    tagged = []

    def note(_scene, depsgraph):
        tagged.extend(update.id.name for update in depsgraph.updates)

    for block in (shown, other):
        obj = bpy.data.objects.new(block.name, bpy.data.meshes.new(block.name))
        obj.data.materials.append(block)
        bpy.context.scene.collection.objects.link(obj)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Lamp", lamp))
    bpy.context.scene.world = world
    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        bpy.context.scene.spectral.viewport.preview_lamp = "HP1"
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)
    assert {"Shown", "Lamp", "World"} <= set(tagged)
    assert "Other" not in tagged


def test_a_name_that_no_lamp_has_is_reported_in_the_panel(blender):
    """The previews were empty, and only the console told why."""
    from types import SimpleNamespace
    from unittest.mock import MagicMock

    from blender_addon.panels.viewport import SPECTRAL_PT_look

    def told(name):
        bpy.context.scene.spectral.viewport.preview_lamp = name
        layout = MagicMock()
        context = SimpleNamespace(
            scene=bpy.context.scene, view_layer=bpy.context.view_layer, region=None, preferences=None
        )
        SPECTRAL_PT_look.draw(SimpleNamespace(layout=layout), context)
        labels = layout.column.return_value.column.return_value.column.return_value.label.mock_calls
        return " ".join(each.kwargs["text"] for each in labels)

    assert told("HP1") == told("") == told("  ") == ""
    assert "'sodum'" in told("sodum")
    assert "'sodium'" in told("sodum"), "the nearest name"
    assert "500" in told("blackbody 10")
    assert told("blackbody 3200") == ""
