# SPDX-License-Identifier: GPL-3.0-or-later
"""The render panel: samples, transport, and the plan with its reasons and overrides."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

from blender_addon import compat
from blender_addon.translate.settings import overrides_of


@pytest.fixture
def settings(blender):
    """A cube with a camera and a lamp, and its render settings."""
    blender.ops.mesh.primitive_cube_add()
    paint = blender.data.materials.new("paint")
    compat.use_nodes(paint).nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.6, 0.1, 0.1, 1)
    blender.context.object.data.materials.append(paint)
    blender.ops.object.camera_add(location=(0, -5, 0), rotation=(1.5708, 0, 0))
    blender.context.scene.camera = blender.context.object
    blender.ops.object.light_add(type="POINT", location=(2, -3, 3))
    return blender.context.scene.spectral.render


def line(settings, effect: str):
    return settings.plan[effect]


def test_the_plan_is_shown_with_reasons(blender, settings):
    blender.ops.spectral.plan()
    assert line(settings, "transport").value == "rgb"
    assert all(decision.reason for decision in settings.plan)
    lamp = blender.context.object.data
    lamp.spectral.source = "CATALOGUE"
    lamp.spectral.catalogue_name = "HP1"
    blender.ops.spectral.plan()
    assert line(settings, "transport").value == "spectral"
    assert lamp.name in line(settings, "transport").reason or "Point" in line(settings, "transport").reason
    assert line(settings, "transport").cost and line(settings, "transport").error > 1
    assert line(settings, "bounces").how == "measured" and line(settings, "bounces").value != "64"


def test_a_decision_is_overridden_and_reset(blender, settings):
    blender.ops.spectral.plan()
    blender.ops.spectral.plan_override(effect="transport", value="spectral")
    assert settings.transport == "SPECTRAL"
    assert overrides_of(settings) == {"transport": "spectral"}
    assert line(settings, "transport").is_artists
    assert line(settings, "transport").reason.startswith("set by the artist")
    blender.ops.spectral.plan_release(effect="transport")
    assert settings.transport == "AUTO"
    assert not line(settings, "transport").is_artists
    blender.ops.spectral.plan_override(effect="bounces", value="3")
    assert overrides_of(settings) == {"bounces": "3"}
    assert line(settings, "bounces").value == "3"
    blender.ops.spectral.plan_release(effect="bounces")
    assert overrides_of(settings) == {}


@pytest.mark.parametrize(
    ("effect", "value", "message"),
    [("bounces", "many", "expected a whole number"), ("levitation", "on", "no effect is named 'levitation'")],
)
def test_a_wrong_override_is_refused_and_dropped(blender, settings, effect, value, message):
    with pytest.raises(RuntimeError, match=message):
        blender.ops.spectral.plan_override(effect=effect, value=value)
    assert overrides_of(settings) == {}


def test_a_decision_that_cannot_be_planned_anew_keeps_its_override(blender, settings):
    """The override was gone, and the panel still named it."""
    blender.ops.spectral.plan_override(effect="bounces", value="3")
    blender.context.scene.camera = None
    with pytest.raises(RuntimeError, match="camera"):
        blender.ops.spectral.plan_release(effect="bounces")
    assert overrides_of(settings) == {"bounces": "3"}
    assert line(settings, "bounces").is_artists


def test_settings_reach_the_translated_scene(blender, settings):
    from blender_addon.translate.scene import translate_scene

    settings.samples, settings.seed, settings.transport, settings.tolerance = 17, 5, "RGB", 2.5
    scene = translate_scene(blender.context.evaluated_depsgraph_get())
    assert (scene.film.samples, scene.film.seed) == (17, 5)
    assert scene.settings.transport == "rgb"
    assert scene.settings.tolerance_delta_e == 2.5


def test_the_cost_of_accuracy_is_shown(blender, settings):
    blender.context.scene.render.resolution_x = blender.context.scene.render.resolution_y = 24
    settings.samples = 8
    blender.ops.spectral.cost()
    assert {point.axis for point in settings.cost} >= {"samples", "bounces"}
    assert "As it is set" in settings.cost_summary and settings.cost[0].seconds > 0


def test_an_error_that_is_a_lower_bound_says_so(blender, settings):
    from blender_addon.operators.render import store_curve
    from spectral_core.render.cost.curve import CostCurve
    from spectral_core.render.cost.model import CostModel, Prediction, RareLight

    said = Prediction(8, 1.0, 2.0).with_rare(RareLight(1.5, 3.0, "light over glass or mirrors"))
    store_curve(settings, CostCurve((), CostModel((1, 4), (2.0, 1.0), 0.1, 0.1), said, said, 1, 1.0, None))
    assert "at least ΔE 2.5" in settings.cost_summary
    assert "light over glass or mirrors" in settings.cost_summary and "ΔE 1.5 of it" in settings.cost_summary


def test_a_target_error_or_time_reaches_the_translated_scene(blender, settings):
    from blender_addon.translate.scene import translate_scene

    asked = lambda: translate_scene(blender.context.evaluated_depsgraph_get()).settings  # noqa: E731
    settings.target_error, settings.time_budget = 0.5, 7.0
    assert asked().target_error is None and asked().time_budget_s is None
    settings.goal = "ERROR"
    assert asked().target_error == 0.5 and asked().time_budget_s is None
    settings.goal = "TIME"
    assert asked().target_error is None and asked().time_budget_s == 7.0


def add_what_the_viewport_shows_differently(blender):
    """A cube that renders alone show, one that the viewport alone shows, and a sphere with finer faces in renders."""
    for name in ("Rendered", "Shown"):
        blender.ops.mesh.primitive_cube_add(location=(3, 0, 0))
        blender.context.object.name = name
    blender.data.objects["Rendered"].hide_viewport = blender.data.objects["Shown"].hide_render = True
    blender.ops.mesh.primitive_cube_add(location=(-3, 0, 0))
    blender.context.object.name = "Fine"
    modifier = blender.context.object.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 2


def read_by(blender, monkeypatch, tmp_path, operator):
    """The scene that an operator reads; nothing is traced or written."""
    from blender_addon import jobs
    from spectral_core.errors import RenderError
    from spectral_core.render import mitsuba_export, plan_from_data

    seen = []

    def stopped(scene, *_, **_options):
        seen.append(scene)
        raise RenderError("enough")

    monkeypatch.setattr(jobs.process, "plan", lambda scene, **_: seen.append(scene) or plan_from_data(scene))
    monkeypatch.setattr(jobs.process, "cost_curve", stopped)
    monkeypatch.setattr(mitsuba_export, "write_mitsuba", stopped)
    options = {"directory": str(tmp_path / "export")} if operator == "write_mitsuba" else {}
    if operator == "plan":
        blender.ops.spectral.plan()
    else:
        with pytest.raises(RuntimeError, match="enough"):
            getattr(blender.ops.spectral, operator)(**options)
    return seen[0]


@pytest.mark.parametrize("operator", ["plan", "cost", "write_mitsuba"])
def test_an_operator_reads_the_scene_as_f12_renders_it(blender, settings, monkeypatch, tmp_path, operator):
    add_what_the_viewport_shows_differently(blender)
    blender.context.scene.render.engine = "CYCLES"
    scene = read_by(blender, monkeypatch, tmp_path, operator)
    names = {each.name for each in scene.instances}
    assert "Rendered" in names and "Shown" not in names
    fine = next(each for each in scene.instances if each.name == "Fine")
    assert len(next(each for each in scene.meshes if each.name == fine.mesh).triangles) > 12
    assert blender.context.scene.render.engine == "CYCLES"


def test_a_plan_says_which_view_layers_are_left_out(blender, settings, monkeypatch, tmp_path, capfd):
    read_by(blender, monkeypatch, tmp_path, "plan")
    assert "left out" not in capfd.readouterr().out
    blender.context.scene.view_layers.new("Near")
    read_by(blender, monkeypatch, tmp_path, "plan")
    assert "Warning: only the view layer 'ViewLayer' was read; left out: 'Near'" in capfd.readouterr().out


def test_an_override_that_cannot_be_planned_is_dropped(blender, settings):
    camera = blender.context.scene.camera
    blender.data.objects.remove(camera)
    with pytest.raises(RuntimeError, match="camera"):
        blender.ops.spectral.plan_override(effect="bounces", value="3")
    assert overrides_of(settings) == {}
