# SPDX-License-Identifier: GPL-3.0-or-later
"""The view under a chosen light: one click for viewport and F12, a split view, previews under a lamp."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Film
from spectral_core.spectra import catalogue

bpy = pytest.importorskip("bpy")
from blender_addon.translate.viewport.look import look_of, notes_of  # noqa: E402


def updated(stage):
    bpy.context.view_layer.update()
    depsgraph = bpy.context.view_layer.depsgraph
    stage.session.update(stage.context, depsgraph)
    return stage.session.look(stage.context, depsgraph)


def sky_of(world):
    """A sky with a sun as the world's color."""
    if world.node_tree is None:  # before Blender 5
        world.use_nodes = True
    tree = world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = next(
        name for name in ("MULTIPLE_SCATTERING", "NISHITA")
        if name in sky.bl_rna.properties["sky_type"].enum_items
    )  # fmt: skip
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs["Color"])


def test_one_click_selects_a_palette_light_for_the_view_and_another_resets_it(stage):
    palette, settings = stage.scene.spectral.palette, stage.scene.spectral.viewport
    column = palette.lights.add()
    column.name, column.light = "Evening", bpy.data.lights["Lamp"]
    other = bpy.data.objects.new("Other", bpy.data.lights.new("Other", "POINT"))
    stage.scene.collection.objects.link(other)
    bpy.ops.spectral.look_under(kind="COLUMN", name="Evening")
    assert (settings.look.kind, settings.look.column) == ("COLUMN", "Evening")
    updated(stage)
    scene = next(iter(stage.link.scenes.values()))
    assert [light.name for light in scene.lights] == ["Lamp"]
    bpy.ops.spectral.look_under(kind="COLUMN", name="Evening")
    assert settings.look.kind == "SCENE"
    updated(stage)
    assert [light.name for light in next(iter(stage.link.scenes.values())).lights] == ["Lamp", "Other"]


def test_a_palette_light_keeps_the_copies_of_its_lamp_in_collection_instances(stage):
    column = stage.scene.spectral.palette.lights.add()
    column.name, column.light = "Street", bpy.data.lights.new("Street", "POINT")
    inner, outer = bpy.data.collections.new("Lantern"), bpy.data.collections.new("Street")
    inner.objects.link(bpy.data.objects.new("Bulb", column.light))
    nested = bpy.data.objects.new("Nested", None)
    nested.instance_type, nested.instance_collection = "COLLECTION", inner
    outer.objects.link(nested)
    for number in range(3):
        empty = bpy.data.objects.new(f"Post {number}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", outer
        stage.scene.collection.objects.link(empty)
    bpy.ops.spectral.look_under(kind="COLUMN", name="Street")
    updated(stage)
    lights = [light.name for light in next(iter(stage.link.scenes.values())).lights]
    assert lights == ["Bulb", "Bulb #2", "Bulb #3"], "neither Lamp nor a copy that is dark"


def test_a_palette_light_keeps_its_lamp_in_the_background_scene(stage):
    """No lamp of the light was found there, and the view showed all lamps."""
    column = stage.scene.spectral.palette.lights.add()
    column.name, column.light = "Street", bpy.data.lights.new("Street", "POINT")
    street, city = bpy.data.scenes.new("Street"), bpy.data.scenes.new("City")
    city.collection.objects.link(bpy.data.objects.new("Lantern", column.light))
    street.background_set, stage.scene.background_set = city, street
    bpy.ops.spectral.look_under(kind="COLUMN", name="Street")
    updated(stage)
    assert [light.name for light in next(iter(stage.link.scenes.values())).lights] == ["Lantern"]


def test_a_palette_light_keeps_the_sun_of_its_world(stage):
    world = stage.scene.world = bpy.data.worlds.new("Noon")
    sky_of(world)
    column = stage.scene.spectral.palette.lights.add()
    column.name, column.world = "Noon", world
    updated(stage)
    assert [light.name for light in next(iter(stage.link.scenes.values())).lights] == ["Lamp", "Noon sun 1"]
    bpy.ops.spectral.look_under(kind="COLUMN", name="Noon")
    updated(stage)
    assert [light.name for light in next(iter(stage.link.scenes.values())).lights] == ["Noon sun 1"]


def test_a_lamp_that_is_named_like_a_copy_or_a_sun_stays_dark(stage):
    """Numbers of copies and suns are added to names at the translation; an artist may use them too."""
    world = stage.scene.world = bpy.data.worlds.new("Noon")
    sky_of(world)
    column = stage.scene.spectral.palette.lights.add()
    column.name, column.light, column.world = "Noon", bpy.data.lights["Lamp"], world
    for name in ("Lamp #2", "Noon sun 1"):
        stage.scene.collection.objects.link(bpy.data.objects.new(name, bpy.data.lights.new(name, "POINT")))
    updated(stage)
    names = [light.name for light in next(iter(stage.link.scenes.values())).lights]
    assert names == ["Lamp", "Lamp #2", "Noon sun 1", "Noon sun 1 #2"]
    bpy.ops.spectral.look_under(kind="COLUMN", name="Noon")
    updated(stage)
    names = [light.name for light in next(iter(stage.link.scenes.values())).lights]
    assert names == ["Lamp", "Noon sun 1 #2"]


def test_a_palette_light_is_of_the_world_that_its_view_layer_shows(stage):
    """World Override replaces the world of a scene in a view layer."""
    stage.scene.world, shown = bpy.data.worlds.new("Day"), bpy.data.worlds.new("Night")
    column, look = stage.scene.spectral.palette.lights.add(), stage.scene.spectral.viewport.look
    column.name, column.world = "Night", shown
    look.kind, look.column = "COLUMN", "Night"
    for world, is_shown in ((None, False), (shown, True)):
        assert look_of(look, stage.scene, SimpleNamespace(world_override=world)).with_world is is_shown


def test_a_picture_is_adapted_to_the_light_under_which_it_was_rendered(stage, monkeypatch):
    """The picture of a paused view, and the last one before a new one comes, are still under the other light."""
    monkeypatch.setattr(stage.link, "latest", lambda view: SimpleNamespace(frame=SimpleNamespace(generation=done)))
    monkeypatch.setattr(stage.session, "_wait", lambda began, waits: None)
    monkeypatch.setattr("blender_addon.editing.viewport.patience.Patience.notice", lambda patience, picture: None)
    view, done = stage.scene.spectral.viewport, 1
    view.look.kind, view.look.lamp, view.look.adapts = "LAMP", "A", True
    before = updated(stage)[0].matrix
    assert not np.allclose(before, np.eye(3))
    view.is_paused = True
    view.look.lamp, view.look.exposure = "FL11", 1.0
    np.testing.assert_allclose(updated(stage)[0].matrix, 2 * before)
    view.is_paused = False
    np.testing.assert_allclose(updated(stage)[0].matrix, 2 * before, err_msg="the new picture has not come")
    done = 2
    assert not np.allclose(updated(stage)[0].matrix, 2 * before)


def test_a_light_group_that_was_renamed_is_reported(stage):
    settings, layer = stage.scene.spectral.viewport, stage.scene.view_layers[0]
    layer.lightgroups.add(name="Rim")
    bpy.data.objects["Lamp"].lightgroup = "Rim"
    bpy.ops.spectral.look_under(kind="GROUP", name="Rim")
    assert not updated(stage)[0].trouble
    layer.lightgroups[0].name = "Kicker"
    settings.id_data.update_tag()
    told = "the scene has no light group 'Rim' to look under; it has Kicker; choose another one, or look at it As It Is"
    assert updated(stage)[0].trouble == told
    settings.look.group = "Kicker"
    assert not updated(stage)[0].trouble


def test_a_split_view_has_two_lights_and_a_divider(stage):
    settings = stage.scene.spectral.viewport
    bpy.ops.spectral.look_split()
    assert settings.is_split
    settings.look.kind, settings.look.lamp = "LAMP", "D65"
    settings.other.kind, settings.other.lamp, settings.other.exposure = "LAMP", "HP1", 1.0
    settings.other.adapts = True
    settings.divider = 0.25
    pictures = updated(stage)
    assert len(pictures) == 2
    whites = [scene.settings.white.name for scene in stage.link.scenes.values()]
    assert whites == [catalogue.illuminant(name).name for name in ("D65", "HP1")]
    assert pictures[0].matrix == pytest.approx(np.eye(3))
    assert pictures[1].matrix[0, 0] < pictures[1].matrix[2, 2], "an eye used to sodium light sees less of its red"
    before = len(stage.link.requests)
    settings.divider = 0.75
    updated(stage)
    assert len(stage.link.requests) == before, "a divider traces nothing anew"
    bpy.ops.spectral.look_split()
    assert len(updated(stage)) == 1
    assert not bpy.ops.spectral.look_divide.poll(), "bpy has no 3D view whose divider could be dragged"


def test_f12_uses_the_same_light_with_a_note(stage):
    from blender_addon import jobs
    from blender_addon.engine import SpectralRenderEngine

    scene = stage.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 8)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = 16, 12
    scene.spectral.render.samples = 4
    scene.view_layers[0].lightgroups.add(name="Side")
    bpy.ops.spectral.look_under(kind="GROUP", name="Side")
    bpy.data.objects["Lamp"].lightgroup = "Side"
    bpy.ops.render.render()
    assert SpectralRenderEngine.bl_idname == "SPECTRAL"
    notes = [note.message for note in jobs.records[-1].notes if note.subject == "Look"]
    assert notes
    assert jobs.records[-1].status == "done"


def test_the_note_of_f12_names_what_the_look_changes(stage):
    """An exposure under the scene's own lamps was noted as another light, with the advice to choose these lamps."""
    look = stage.scene.spectral.viewport.look

    def told():
        return [note.message for note in notes_of(look_of(look, stage.scene))]

    assert told() == []
    look.exposure = 1.0
    (exposed,) = told()
    assert exposed.startswith("it is 1 stop brighter by the Exposure") and "As It Is" not in exposed
    look.kind, look.lamp, look.exposure = "LAMP", "A", -1.1
    light, exposed = told()
    assert "As It Is" in light
    assert "1.1 stops darker" in exposed


def test_a_palette_light_that_is_not_chosen_yet_is_no_unknown_one(stage):
    """Choosing Palette Light in the list of looks told of a light named ''."""
    look = stage.scene.spectral.viewport.look
    look.kind = "COLUMN"
    with pytest.raises(InvalidInputError, match="no light of the palette is chosen .* the palette has none"):
        look_of(look, stage.scene)
    stage.scene.spectral.palette.lights.add().name = "Evening"
    with pytest.raises(InvalidInputError, match="no light of the palette is chosen to look under; choose one"):
        look_of(look, stage.scene)


@pytest.mark.parametrize(("kind", "is_on"), [("SCENE", False), ("GROUP", False), ("COLUMN", True), ("LAMP", True)])
def test_adapt_to_light_is_offered_where_there_is_one_light(stage, kind, is_on):
    """Under the others it changes nothing, and the button seemed to be broken."""
    from blender_addon.panels.viewport import draw_look

    class Layout(SimpleNamespace):
        shown = {}

        def prop(self, _owner, name, **_options):
            self.shown[name] = self.enabled

        def __getattr__(self, _name):
            return lambda *_arguments, **_options: Layout(enabled=True)

    look = stage.scene.spectral.viewport.look
    look.kind, look.lamp, look.column = kind, "A", "Evening"
    context = SimpleNamespace(scene=stage.scene, view_layer=None, region=SimpleNamespace(width=300), preferences=None)
    stage.scene.spectral.palette.lights.add().name = "Evening"
    draw_look(Layout(enabled=True), context, look, "look")
    assert Layout.shown["adapts"] is is_on
    assert Layout.shown["exposure"]


def test_previews_use_the_chosen_lamp(stage):
    from blender_addon.translate.scene import translate_scene
    from blender_addon.translate.viewport.look import preview_scene
    from spectral_core.scene import Camera

    depsgraph = bpy.context.evaluated_depsgraph_get()
    made = translate_scene(depsgraph, film=Film(8, 8), seen_from=Camera(world_from_camera=np.eye(4)))
    assert preview_scene(made, bpy.data.window_managers).settings.white is None
    lamps = [
        SimpleNamespace(spectral=SimpleNamespace(viewport=SimpleNamespace(preview_lamp=each))) for each in ("", "HP1")
    ]
    windows = [SimpleNamespace(scene=scene) for scene in lamps]
    managers = [SimpleNamespace(windows=windows)]
    assert preview_scene(made, managers).settings.white.name == catalogue.illuminant("HP1").name, "of the second window"
    managers = [SimpleNamespace(windows=windows[:1])]
    assert preview_scene(made, managers).settings.white is None
