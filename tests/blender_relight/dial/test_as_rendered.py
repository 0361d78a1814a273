# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene is read as F12 renders it, and the artist's files, settings and picture stay; view layers are named."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon import jobs
from blender_addon.commands.plan import translated_scene
from blender_addon.editing.dial import changes
from blender_addon.editing.dial.as_rendered import SLOT, AsRendered, Layers
from spectral_core.errors import InvalidInputError, RenderCancelled


def by_button(scene):
    return AsRendered(bpy.context, at_once=True).take()


def by_command(scene):
    return translated_scene(SimpleNamespace(variant=None))


def settings_of(scene):
    render = scene.render
    return render.engine, render.use_compositing, render.use_sequencer, [each.use for each in scene.view_layers]


def add_file_output(scene, folder):
    """A compositor that writes the picture to a file."""
    if hasattr(scene, "compositing_node_group"):
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
    layers, output = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeOutputFile")
    if hasattr(output, "directory"):
        output.directory, output.file_name = str(folder), "picture"
        output.file_output_items.new("RGBA", "Image")
    else:
        output.base_path = str(folder)
    tree.links.new(layers.outputs["Image"], output.inputs["Image"])


def add_strip(scene):
    """A strip of a color in the sequencer, which F12 shows in place of the scene."""
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    length = "length" if "length" in strips.bl_rna.functions["new_effect"].parameters else "frame_end"
    return strips.new_effect(name="Color", type="COLOR", channel=1, frame_start=1, **{length: 25})


@pytest.mark.parametrize("read", [by_button, by_command])
def test_files_of_the_compositor_are_not_written(stage, tmp_path, read):
    folder = tmp_path / "composited"
    add_file_output(stage, folder)

    def stop(scene):
        raise RenderCancelled("seen enough")

    with jobs.request(jobs.RenderRequest(translated=stop)):
        bpy.ops.render.render()
    written = list(folder.iterdir())
    assert written, "Blender composites after a render that was stopped"
    for path in written:
        path.unlink()
    before = settings_of(stage)
    assert before[1]
    assert read(stage).instances
    assert list(folder.iterdir()) == []
    assert settings_of(stage) == before


@pytest.mark.parametrize("read", [by_button, by_command])
def test_a_scene_whose_sequencer_has_strips_is_read(stage, read):
    add_strip(stage)
    before = settings_of(stage)
    assert before[2]
    assert read(stage).instances
    assert settings_of(stage) == before


def test_settings_are_restored_after_an_error(stage):
    bpy.data.objects.remove(stage.camera)
    stage.render.engine = "CYCLES"
    before = settings_of(stage)
    with pytest.raises(InvalidInputError, match="camera"):
        by_button(stage)
    assert settings_of(stage) == before


def test_two_that_overlap_restore_the_settings_of_the_artist(stage):
    stage.render.engine = "CYCLES"
    stage.view_layers.new("Unused").use = False
    stage.view_layers.new("Used")
    before = settings_of(stage)
    first = AsRendered(bpy.context, at_once=True)
    second = AsRendered(bpy.context, at_once=True)
    assert first.take().instances
    assert settings_of(stage) != before, "the second one goes on"
    assert second.take().instances
    assert settings_of(stage) == before
    assert jobs.current_request().translated is None


def test_the_picture_of_f12_stays(stage, tmp_path):
    stage.render.engine, stage.cycles.samples, stage.cycles.use_denoising = "CYCLES", 1, False
    bpy.ops.render.render()

    def picture(name):
        path = str(tmp_path / name)
        bpy.data.images["Render Result"].save_render(path)
        image = bpy.data.images.load(path)
        return np.array(image.pixels[:])

    before = picture("before.png")
    assert before.reshape(-1, 4)[:, :3].max() > 0.1
    for name in ("first.png", "second.png"):
        by_button(stage)
        np.testing.assert_array_equal(picture(name), before)
    slots = bpy.data.images["Render Result"].render_slots
    assert [each.name for each in slots].count(SLOT) == 1 and slots.active_index == 0
    bpy.ops.render.render()
    np.testing.assert_array_equal(picture("again.png"), before)


@pytest.fixture
def layers(stage):
    """The stage with a second view layer, "Near": "Lamp of Near" is in it alone, "Lamp of Far" in the first alone."""
    first, second = stage.view_layers[0], stage.view_layers.new("Near")
    first.name = "Far"
    for layer, other in ((first, second), (second, first)):
        own = bpy.data.collections.new(layer.name)
        stage.collection.children.link(own)
        name = f"Lamp of {layer.name}"
        own.objects.link(bpy.data.objects.new(name, bpy.data.lights.new(name, "POINT")))
        other.layer_collection.children[own.name].exclude = True
    return stage.view_layers


def show(layer):
    bpy.context.window.view_layer = layer


def test_the_view_layer_of_the_window_is_read_and_others_are_named(stage, layers):
    for layer, other in ((layers["Near"], "Far"), (layers["Far"], "Near")):
        show(layer)
        asked = AsRendered(bpy.context, at_once=True)
        names = {each.name for each in asked.take().lights}
        assert f"Lamp of {layer.name}" in names and f"Lamp of {other}" not in names
        assert asked.layers == Layers(layer.name, (other,))
        assert asked.layers.told == f"only the view layer {layer.name!r} was read; left out: {other!r}"
    assert all(each.use for each in layers)
    layers["Near"].use = False
    assert Layers.of(stage, layers["Far"]).told == ""
    layers["Near"].use, stage.render.use_single_layer = True, True
    assert Layers.of(stage, layers["Far"]).told == ""


def test_a_command_reads_the_first_layer_that_is_rendered_and_names_others(stage, layers, capsys):
    def lamps():
        return {each.name for each in by_command(stage).lights}

    show(layers["Near"])
    assert "Lamp of Far" in lamps()
    assert "note: only the view layer 'Far' was read; left out: 'Near'" in capsys.readouterr().err
    layers["Far"].use = False
    assert "Lamp of Near" in lamps()
    assert "left out" not in capsys.readouterr().err


def test_the_scene_is_compared_in_the_view_layer_that_was_recorded(stage, layers):
    show(layers["Near"])
    by_button(stage)
    changes.remember_parts(stage, changes.read_parts(stage).hashes())
    stage.spectral.dial.scene_hash = "recorded"
    show(layers["Far"])
    assert changes.compare(stage) == ""
    bpy.data.lights["Lamp of Far"].energy *= 2
    assert changes.compare(stage) == ""
    before = changes.parts_of(stage)
    bpy.data.lights["Lamp of Near"].energy *= 2
    assert changes.compare(stage) == "light 'Lamp of Near' was changed"
    changes.accept(stage, before)
    assert changes.compare(stage) == ""
    layers["Near"].name = "Other"
    assert changes.compare(stage) == "view layer 'Near' was removed or renamed"


def test_a_view_layer_that_no_window_has_shown_is_read(stage):
    stage.view_layers.new("Unseen")
    assert stage.view_layers["Unseen"].depsgraph is None
    assert changes.read_parts(stage, layer="Unseen").layer == "Unseen"


def test_a_recording_of_an_earlier_version_names_no_layer(stage, layers):
    show(layers["Near"])
    parts = changes.read_parts(stage, layer="Near").hashes()
    del parts[changes.LAYER]
    changes.remember_parts(stage, parts)
    stage.spectral.dial.scene_hash = "recorded"
    by_button(stage)
    assert changes.compare(stage) == ""


def test_record_says_which_view_layers_are_left_out(stage, layers, capfd):
    pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")
    show(layers["Near"])
    bpy.ops.spectral.dial_record()
    assert "Mixtures; only the view layer 'Near' was read; left out: 'Far'\n" in capfd.readouterr().out
    assert "Lamp of Near" in stage.spectral.dial.bulbs and "Lamp of Far" not in stage.spectral.dial.bulbs
    show(layers["Far"])
    bpy.ops.spectral.dial_check()
    assert stage.spectral.dial.changes == ""


@pytest.mark.parametrize("read", [by_button, by_command])
def test_the_scene_has_the_exposure_with_which_it_is_seen(stage, read):
    stage.view_settings.exposure, stage.spectral.viewport.look.exposure = 3.0, -1.0
    assert read(stage).settings.display_exposure == pytest.approx(4.0)
