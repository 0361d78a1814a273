# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's panels that are shown for the engine, and notes on passes that are not rendered."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon import properties
from blender_addon.properties.render import ENGINE
from blender_addon.translate.passes import pass_notes


def shown() -> list[type]:
    return [each for each in bpy.types.Panel.__subclasses__() if ENGINE in getattr(each, "COMPAT_ENGINES", ())]


@pytest.mark.parametrize("space", ["PROPERTIES", "NODE_EDITOR"])
def test_a_light_has_one_panel_named_light(registered, space):
    named = [each.__name__ for each in shown() if each.bl_label == "Light" and each.bl_space_type == space]
    assert len(named) == 1, named


@pytest.mark.parametrize("feature", ["freestyle", "gpencil", "grease_pencil"])
def test_panels_of_what_blender_draws_itself_are_shown(registered, feature):
    """Its lines are in the picture of every engine; without these panels nothing could switch them off."""
    panels = [each for each in bpy.types.Panel.__subclasses__() if feature in each.__name__.lower()]
    of_renders = {each for each in panels if "BLENDER_RENDER" in getattr(each, "COMPAT_ENGINES", ())}
    assert of_renders <= set(shown())


@pytest.mark.parametrize(
    "name", ["MATERIAL_PT_preview", "EEVEE_WORLD_PT_volume", "CYCLES_OBJECT_PT_lightgroup", "CYCLES_RENDER_PT_film",
             "CYCLES_RENDER_PT_light_paths_clamping", "CYCLES_RENDER_PT_motion_blur"],
)  # fmt: skip
def test_panels_of_settings_that_are_read_are_shown(registered, name):
    panels = {each.__name__: each for each in bpy.types.Panel.__subclasses__()}
    if name not in panels:
        pytest.skip("this Blender has no such panel, or Cycles is disabled")
    context = SimpleNamespace(engine=ENGINE, world=True, material=MagicMock(grease_pencil=False))
    assert panels[name].poll(context)


def test_other_panels_of_cycles_stay_hidden_and_nothing_is_left(registered):
    """All panels of Cycles share one set of engines."""
    from blender_addon.panels import shared

    panels = {each.__name__: each for each in bpy.types.Panel.__subclasses__()}
    borrowed = panels.get("CYCLES_RENDER_PT_film")
    if borrowed is None:
        pytest.skip("Cycles is disabled")
    assert not panels["CYCLES_RENDER_PT_performance"].poll(SimpleNamespace(engine=ENGINE))
    before = shown()
    shared.show()  # as after a file
    assert shown() == before
    shared.unregister()
    try:
        assert {each.__name__ for each in shown() if not each.__name__.startswith("SPECTRAL")} == set()
        assert "COMPAT_ENGINES" not in vars(borrowed)
        assert not borrowed.poll(SimpleNamespace(engine=ENGINE))
    finally:
        shared.register()
    assert shown() == before


def names_drawn(panel: type, **context: object) -> list[str]:
    """Names of the settings that a panel draws."""
    layout = MagicMock()
    layout.column.return_value = layout
    drawing = SimpleNamespace(layout=layout, column=lambda heading="": layout)
    panel.draw(drawing, SimpleNamespace(view_layer=bpy.context.view_layer, **context))
    return [call.args[1] for call in layout.mock_calls if call[0].startswith("prop")]


def test_settings_that_only_panels_of_cycles_show_have_panels_here(blender):
    from blender_addon.panels import settings

    material, world = bpy.data.materials.new("Plaster"), bpy.data.worlds.new("Dusk")
    lamp = bpy.data.lights.new("Sky", "AREA")
    cube = bpy.data.objects.new("Cube", bpy.data.meshes.new("Cube"))
    assert {"visible_camera", "visible_shadow", "is_shadow_catcher"} <= set(
        names_drawn(settings.SPECTRAL_PT_ray_visibility, object=cube)
    )
    assert "displacement_method" in names_drawn(settings.SPECTRAL_PT_material_settings, material=material)
    drawn = set(names_drawn(settings.SPECTRAL_PT_light_settings, light=lamp))
    assert {"use_shadow", "spread"} <= drawn
    assert not hasattr(lamp, "cycles") or {"max_bounces", "use_multiple_importance_sampling", "is_portal"} <= drawn
    assert "lightgroup" in names_drawn(settings.SPECTRAL_PT_world_settings, world=world)


def test_denoising_is_off_by_default_and_independent_of_the_switch_of_cycles(blender, monkeypatch):
    from blender_addon import jobs
    from blender_addon.translate.settings import settings_of
    from spectral_core.render.denoise import PACKAGE

    scene = blender.context.scene
    if hasattr(scene, "cycles"):
        scene.cycles.use_denoising = True
    assert not settings_of(scene).denoise
    scene.spectral.render.denoise = True
    assert settings_of(scene).denoise
    monkeypatch.setitem(sys.modules, PACKAGE, None)
    assert "pip install pyoidn" in jobs.missing_denoiser() and jobs.missing_denoiser().startswith("Denoising needs")


def test_passes_that_are_not_rendered_get_a_note(blender):
    layer = blender.context.view_layer
    assert pass_notes(layer) == ()
    layer.use_pass_z = layer.use_pass_diffuse_color = layer.use_pass_vector = True
    (note,) = pass_notes(layer)
    assert note.subject == f"view layer {layer.name}"
    assert note.message == "Vector: not rendered; the file does not hold it"


def test_the_engine_is_named_in_one_place() -> None:
    """A panel that asks for another name would never be shown; only the choice of transport is also called SPECTRAL."""
    assert ENGINE == "SPECTRAL"  # .blend files of every version contain it
    addon = Path(properties.__file__).parents[1]
    named = [
        (path.name, line.strip())
        for path in addon.rglob("*.py")
        for line in path.read_text("utf-8").splitlines()
        if '"SPECTRAL"' in line
    ]
    assert [line[:22] for _, line in named if not line.startswith("ENGINE =")] == ['("SPECTRAL", "Spectral']
    assert len(named) == 2
