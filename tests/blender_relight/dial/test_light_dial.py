# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial through Blender's own properties and operators."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def bulbs(dial):
    return {bulb.name: bulb for bulb in dial.bulbs}


def relative_error(picture, reference):
    return float(np.abs(picture - reference)[..., :3].max() / np.abs(reference[..., :3]).max())


def test_recording_gives_the_scene_as_it_is(stage, dial, picture, same_paths):
    assert set(bulbs(dial)) == {"Key", "Fill", "Ball", "World"}
    assert Path(bpy.data.filepath).with_suffix(".transport.exr").is_file()
    assert dial.facts.startswith("16×12") and dial.facts.endswith("samples, Mixtures") and dial.message == ""
    assert relative_error(picture(), same_paths()) < 1e-5


def test_apply_renders_the_mixed_picture_and_restore_undoes_it(stage, dial, picture, f12, same_paths):
    before = f12()
    dial.selector = (0.3, -0.4)
    dial.intensity = 2.5
    from blender_addon.editing.dial.live import weights_of

    weights = dict(zip(bulbs(dial), weights_of(dial), strict=True))
    bpy.ops.spectral.dial_apply()
    assert bpy.data.objects["Key"].data.energy == pytest.approx(200 * weights["Key"], rel=1e-6)
    assert bpy.data.materials["Glow"].node_tree.nodes["Emission"].inputs["Strength"].default_value == pytest.approx(
        3 * weights["Ball"], rel=1e-6
    )
    dialled = picture()
    assert relative_error(dialled, same_paths()) < 1e-5
    others = []
    for seed in (5, 6):
        stage.spectral.render.seed = seed
        others.append(f12()[..., :3])
    noise = np.abs(others[1] - others[0]).mean()
    assert 0.5 < np.abs(others[0] - dialled[..., :3]).mean() / noise < 2  # equal within the noise of different paths

    bpy.ops.spectral.dial_apply()  # a second time: relative to the recorded values, not to the applied ones
    assert bpy.data.objects["Key"].data.energy == pytest.approx(200 * weights["Key"], rel=1e-6)
    bpy.ops.spectral.dial_apply(restore=True)
    stage.spectral.render.seed = 0
    assert relative_error(f12(), before) < 1e-6


def test_a_selector_on_a_bulb_shows_that_light_alone(stage, dial, picture, f12):
    dial.selector, dial.intensity = bulbs(dial)["Fill"].place, 1.0
    alone = picture()
    for thing in ("Key", "Ball"):
        bpy.data.objects[thing].hide_render = True
    stage.world = None
    assert alone[..., :3].mean() == pytest.approx(f12()[..., :3].mean(), rel=0.1)


@pytest.mark.usefixtures("without_rays")
def test_a_keyframed_selector_moves_the_picture_with_the_frames(dial, picture, stage, tmp_path):
    first, second = dial.bulbs[0].place[:], dial.bulbs[1].place[:]
    for frame, place in ((1, first), (5, second)):
        dial.selector = place
        assert dial.keyframe_insert("selector", frame=frame)
    dial.intensity = 1.0
    from blender_addon.editing.dial.live import live_mix, weights_of

    seen = []
    for frame in (1, 3, 5):
        stage.frame_set(frame)
        np.testing.assert_allclose(picture(), live_mix(stage).picture(weights_of(dial)), rtol=1e-6)
        seen.append(weights_of(dial))
    np.testing.assert_allclose(seen[0][:2], (1, 0), atol=1e-6)
    np.testing.assert_allclose(seen[2][:2], (0, 1), atol=1e-6)
    assert 0.1 < seen[1][0] < 0.9
    stage.frame_end = 3
    bpy.ops.spectral.dial_save(filepath=str(tmp_path / "walk_.png"), animation=True)
    assert sorted(path.name for path in tmp_path.glob("walk_*.png")) == [f"walk_{k:04d}.png" for k in (1, 2, 3)]


@pytest.mark.usefixtures("without_rays")
def test_all_bulbs_off_is_dark_and_is_reported(dial, picture):
    for bulb in dial.bulbs:
        bulb.is_on = False
    assert not picture()[..., :3].any()
    bpy.ops.spectral.dial_reset()
    assert picture()[..., :3].any() and all(bulb.is_on for bulb in dial.bulbs)
    np.testing.assert_allclose(np.hypot(*np.array([bulb.place for bulb in dial.bulbs]).T), 1.0, rtol=1e-6)


@pytest.mark.usefixtures("without_rays")
def test_the_dial_is_saved_and_loaded(dial, picture):
    dial.selector = (0.25, 0.5)
    dial.bulbs[0].is_on = False
    before = picture()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    again = bpy.context.scene.spectral.dial
    assert tuple(again.selector) == (0.25, 0.5) and not again.bulbs[0].is_on
    bpy.ops.spectral.dial_show()
    np.testing.assert_array_equal(picture(), before)


@pytest.mark.usefixtures("without_rays")
def test_a_truncated_transport_or_one_of_another_scene_is_refused(dial, tmp_path):
    path = Path(bpy.data.filepath).with_suffix(".transport.exr")
    good = path.read_bytes()
    path.write_bytes(good[: len(good) // 2])
    with pytest.raises(RuntimeError, match="record"):
        bpy.ops.spectral.dial_show()
    assert "record" in dial.message
    path.write_bytes(good)
    bpy.ops.spectral.dial_show()
    assert dial.message == ""
    kept = tmp_path / "kept.exr"
    kept.write_bytes(good)
    bpy.ops.spectral.dial_load(filepath=str(kept))
    bpy.data.objects["Key"].location.x += 1
    with pytest.raises(RuntimeError, match="another scene"):
        bpy.ops.spectral.dial_load(filepath=str(kept))


@pytest.mark.usefixtures("without_rays")
def test_shared_lamps_are_copied_when_they_are_applied(stage, dial):
    twin = bpy.data.objects.new("Twin", bpy.data.objects["Key"].data)
    stage.collection.objects.link(twin)
    dial.selector, dial.intensity = bulbs(dial)["Key"].place, 0.5
    bpy.ops.spectral.dial_apply()
    assert bpy.data.objects["Key"].data.energy == pytest.approx(100.0)
    assert twin.data.energy == pytest.approx(200.0) and twin.data != bpy.data.objects["Key"].data


@pytest.mark.usefixtures("without_rays")
def test_a_deleted_light_is_reported_and_nothing_is_written(dial):
    bpy.data.objects.remove(bpy.data.objects["Key"])
    dial.selector = (0.3, 0.2)
    with pytest.raises(RuntimeError, match="a light of the bulb 'Key' was deleted; undo that, or record again"):
        bpy.ops.spectral.dial_apply()
    assert bpy.data.objects["Fill"].data.energy == pytest.approx(80.0)


@pytest.mark.usefixtures("without_rays")
def test_a_light_that_is_deleted_in_a_view_is_reported_and_leaves_the_file(stage, dial, tmp_path):
    """The reference of its bulb kept it in the file, and Apply reported that its power was written."""
    key = bpy.data.objects["Key"]
    bpy.ops.object.select_all(action="DESELECT")
    key.select_set(True)
    bpy.ops.object.delete()
    dial.selector = (0.3, 0.2)
    with pytest.raises(RuntimeError, match="a light of the bulb 'Key' was deleted; undo that, or record again"):
        bpy.ops.spectral.dial_apply()
    assert bpy.data.objects["Fill"].data.energy == pytest.approx(80.0)
    fill = bpy.data.objects["Fill"]
    entry = stage.spectral.board.bindings.add()
    entry.name, entry.control, entry.block = 'bpy.data.objects["Fill"].location[0]', "osc:0:/1", fill
    stage.collection.objects.unlink(fill)
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    with bpy.data.libraries.load(str(path)) as (there, _):
        assert not {"Key", "Fill"} & set(there.objects)
    assert {kept.owner for kept in bulbs(dial)["Ball"].members} == {bpy.data.objects["Ball"]}


@pytest.mark.usefixtures("without_rays")
def test_bake_creates_one_light_with_the_mixed_spectrum(stage, dial):
    from blender_addon.translate.spectra.stored import spectrum_of
    from spectral_core.spectra.color import linear_rgb_from_xyz
    from spectral_core.spectra.observer import xyz_of

    for name in ("Ball", "World"):
        bulbs(dial)[name].is_on = False
    dial.selector = bulbs(dial)["Key"].place
    bpy.ops.spectral.dial_bake(hide=True)
    baked = bpy.data.objects["Dial Light"]
    assert baked.data.type == "POINT" and bpy.data.objects["Key"].hide_render
    orange = 0.2126 + 0.6 * 0.7152 + 0.3 * 0.0722  # its luminance, relative to a white lamp of its power
    assert baked.data.energy == pytest.approx(200 * orange * dial.intensity, rel=1e-3)
    rgb = linear_rgb_from_xyz(xyz_of(spectrum_of(baked.data)))
    np.testing.assert_allclose(rgb / rgb[0], (1.0, 0.6, 0.3), rtol=0.02)


def test_before_recording_every_operator_names_the_remedy(stage):
    for name in ("dial_show", "dial_apply", "dial_bake", "dial_reset", "dial_play"):
        with pytest.raises(RuntimeError, match="press Record"):
            getattr(bpy.ops.spectral, name)()


def test_light_groups_of_blender_and_lamps_in_bands_storage(stage, picture, f12):
    pytest.importorskip("mitsuba")
    dial = stage.spectral.dial
    group = stage.view_layers[0].lightgroups.add(name="Room")
    for name in ("Key", "Fill", "Ball"):
        bpy.data.objects[name].lightgroup = group.name
    dial.one_per_light, dial.storage = False, "DIAL"
    bpy.ops.spectral.dial_record()
    shown = stage.camera.data.background_images
    assert len(shown) == 1
    dial.storage = "BANDS31"
    bpy.ops.spectral.dial_record()
    assert set(bulbs(dial)) == {"Room", ""}
    assert "different spectra" in dial.message  # Key is orange, Ball is blue
    assert len(shown) == 0  # the picture of the earlier recording stayed over the camera view
    bulbs(dial)["Room"].lamp = "HP1"
    assert dial.message == "" and len(shown) == 1
    sodium = picture()[..., :3].mean(axis=(0, 1))
    assert sodium[0] > 2 * sodium[2]
    bpy.ops.spectral.dial_reset()
    with pytest.raises(RuntimeError, match="'Ball' is an emissive object"):
        bpy.ops.spectral.dial_apply()
    bpy.data.objects["Ball"].hide_render = True
    bpy.ops.spectral.dial_record()
    bpy.ops.spectral.dial_apply()
    stage.spectral.render.transport = "SPECTRAL"
    rendered = f12()
    assert bpy.data.objects["Key"].data.spectral.spectrum_name
    np.testing.assert_allclose(picture()[..., :3].mean(axis=(0, 1)), rendered[..., :3].mean(axis=(0, 1)), rtol=0.15)


@pytest.mark.usefixtures("without_rays")
def test_a_path_of_a_foreign_file_is_not_overwritten_and_the_recording_is_kept(dial, picture, tmp_path):
    victim = tmp_path / "thesis.exr"
    victim.write_text("three years of work")
    dial.filepath = str(victim)
    with pytest.raises(RuntimeError, match="no transport file, so it is not replaced"):
        bpy.ops.spectral.dial_record()
    assert victim.read_text() == "three years of work"
    bpy.ops.spectral.dial_show()
    assert picture()[..., :3].any()
    bpy.ops.spectral.dial_keep(filepath=str(tmp_path / "elsewhere.exr"))
    assert dial.filepath == str(tmp_path / "elsewhere.exr")
    bpy.ops.spectral.dial_record()  # an earlier transport is replaced
