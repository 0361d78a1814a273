# SPDX-License-Identifier: GPL-3.0-or-later
"""``spectral-scene render`` and ``plan`` on .blend files, in this process."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


@pytest.fixture
def saved(build, tmp_path):
    """Path of a saved small scene with a light."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 20, 12
    scene.spectral.render.samples = 3
    scene.view_settings.view_transform = "Standard"
    build.plane(size=20, material=build.material("Paper", Color=(0.5, 0.5, 0.5, 1)))
    build.light("SUN", np.pi)
    build.camera()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return tmp_path / "scene.blend"


def call(capfd, *arguments):
    """Exit status, standard output and standard error of a command."""
    from blender_addon.commands import main

    status = main([str(argument) for argument in arguments])
    out, error = capfd.readouterr()
    return status, out, error


def test_render_writes_png_through_the_view_transform(saved, tmp_path, capfd):
    out = tmp_path / "pictures" / "plain {name}#.png"
    status, text, _ = call(capfd, "render", saved, "--out", out, "--samples", 5, "--json")
    report = json.loads(text.splitlines()[-1])
    assert status == 0 and out.is_file() and report["files"] == [str(out)]
    assert report["frames"][0]["samples"] == 5 and report["frames"][0]["transport"] == "rgb"
    assert report["colors"] == "sRGB through the file's view transform Standard"
    image = bpy.data.images.load(str(out))
    assert tuple(image.size) == (20, 12)
    gray = np.array(image.pixels[:]).reshape(-1, 4)[:, :3]
    np.testing.assert_allclose(gray, 1.055 * 0.5 ** (1 / 2.4) - 0.055, atol=0.01)  # linear 0.5 on an sRGB screen


def test_render_writes_linear_exr_and_an_animation(saved, tmp_path, capfd):
    bpy.context.scene.frame_end = 2
    bpy.ops.wm.save_mainfile()
    status, text, _ = call(capfd, "render", saved, "--out", tmp_path / "walk.exr", "--animation", "--json")
    assert status == 0
    assert [entry["frame"] for entry in json.loads(text.splitlines()[-1])["frames"]] == [1, 2]
    image = bpy.data.images.load(str(tmp_path / "walk_0002.exr"))
    np.testing.assert_allclose(np.array(image.pixels[:]).reshape(-1, 4)[:, :3], 0.5, rtol=0.02)


def test_marks_in_a_name_are_the_number_of_the_frame(saved, tmp_path, capfd, monkeypatch):
    bpy.context.scene.frame_end = 2
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot #3.blend"))
    monkeypatch.chdir(tmp_path)
    assert call(capfd, "render", "shot #3.blend", "--out", "a_##_b.png", "--animation")[0] == 0
    assert call(capfd, "render", "shot #3.blend", "--animation")[0] == 0  # of its own name nothing is replaced
    assert call(capfd, "render", "shot #3.blend", "--out", "c_###.png", "--frame", "2")[0] == 0
    expected = ["a_01_b.png", "a_02_b.png", "c_002.png", "shot #3_0001.png", "shot #3_0002.png"]
    assert sorted(path.name for path in tmp_path.glob("*.png")) == expected


@pytest.mark.parametrize(("views_format", "ending", "options"), [
    ("INDIVIDUAL", ".png", ()), ("INDIVIDUAL", ".exr", ("--multilayer",)), ("STEREO_3D", ".png", ()),
])  # fmt: skip
def test_a_stereo_render_is_written_in_all_its_files(saved, tmp_path, capfd, views_format, ending, options):
    render = bpy.context.scene.render
    render.use_multiview = True
    render.image_settings.views_format = views_format
    bpy.ops.wm.save_mainfile()
    out = tmp_path / "pictures" / f"{{eye}}#{ending}"
    status, text, _ = call(capfd, "render", saved, "--out", out, *options, "--json")
    report = json.loads(text.splitlines()[-1])
    eyes = ("_L", "_R") if views_format == "INDIVIDUAL" else ("",)
    expected = [str(out.with_name(f"{{eye}}#{eye}{ending}")) for eye in eyes]
    assert status == 0 and report["files"] == report["frames"][0]["files"] == expected
    assert sorted(map(str, out.parent.iterdir())) == expected


def test_a_stereo_render_leaves_no_file_if_one_cannot_be_written(saved, tmp_path, capfd):
    bpy.context.scene.render.use_multiview = True
    bpy.ops.wm.save_mainfile()
    (tmp_path / "a_R.png").mkdir()
    status, _, error = call(capfd, "render", saved, "--out", tmp_path / "a.png")
    assert status == 1 and "a_R.png is a folder" in error
    assert [path.name for path in tmp_path.glob("a*")] == ["a_R.png"]
    kept = Path(error.split("The result is not lost: it is in ")[1].split(";")[0])
    assert sorted(path.name for path in kept.iterdir()) == ["a_L.png", "a_R.png"]
    shutil.rmtree(kept)


@pytest.mark.skipif(sys.platform != "linux", reason="needs a folder that nobody can write to")
@pytest.mark.parametrize(("command", "option"), [("render", "--out"), ("transport", "--out"), ("cost", "--plot")])
def test_a_closed_folder_is_told_before_the_work(saved, capfd, monkeypatch, command, option):
    """A picture was rendered to its end, for hours, and then lost."""
    from spectral_core.render import RenderProcess

    done = []
    for name in ("render", "cost_curve"):
        monkeypatch.setattr(RenderProcess, name, lambda *_, **__: done.append(1))
    ending = ".exr" if command == "transport" else ".png"
    status, _, error = call(capfd, command, saved, option, f"/proc/picture{ending}")
    assert status == 1 and f"/proc/picture{ending} could not be written" in error
    assert not done


def test_a_plot_of_another_type_is_told_before_the_measurement(saved, tmp_path, capfd):
    status, text, error = call(capfd, "cost", saved, "--plot", tmp_path / "a.gif")
    assert status == 1 and "a.gif ends in '.gif'" in error and "measured on" not in text


def test_render_writes_a_spectral_exr(saved, tmp_path, capfd):
    from spectral_core.render.images.spectral_exr import read_spectral_exr

    out = tmp_path / "bands.exr"
    status, text, _ = call(capfd, "render", saved, "--out", out, "--bands", 7, "--samples", 64, "--json")
    report = json.loads(text.splitlines()[-1])
    assert status == 0 and report["frames"][0]["transport"] == "spectral" and "7 bands" in report["colors"]
    wavelengths, radiance = read_spectral_exr(out)
    np.testing.assert_allclose(wavelengths, np.linspace(400, 700, 7))
    assert radiance.shape == (12, 20, 7) and radiance.min() > 0


def test_a_spectral_exr_is_written_for_each_view_layer_and_each_eye(saved, tmp_path, capfd):
    from spectral_core.render.images.spectral_exr import read_spectral_exr

    scene = bpy.context.scene
    dark = scene.view_layers.new("No/light")
    scene.collection.children.link(bpy.data.collections.new("Lamps"))
    lamp = next(each for each in scene.objects if each.type == "LIGHT")
    bpy.data.collections["Lamps"].objects.link(lamp)
    for collection in lamp.users_collection:
        if collection.name != "Lamps":
            collection.objects.unlink(lamp)
    dark.layer_collection.children["Lamps"].exclude = True
    bpy.ops.wm.save_mainfile()
    out = tmp_path / "bands.exr"
    status, text, _ = call(capfd, "render", saved, "--out", out, "--bands", 3, "--json")
    files = [tmp_path / "bands_ViewLayer.exr", tmp_path / "bands_No_light.exr"]
    assert status == 0 and json.loads(text.splitlines()[-1])["files"] == list(map(str, files)) and not out.exists()
    lit, unlit = (read_spectral_exr(file)[1] for file in files)
    assert lit.min() > 0 and unlit.max() < lit.min()
    scene = bpy.context.scene
    scene.view_layers.remove(scene.view_layers["No/light"])
    scene.render.use_multiview = True
    scene.camera.data.stereo.interocular_distance = 0.5
    bpy.ops.wm.save_mainfile()
    status, text, _ = call(capfd, "render", saved, "--out", out, "--bands", 3, "--json")
    assert status == 0 and json.loads(text.splitlines()[-1])["files"] == [
        str(tmp_path / "bands_L.exr"), str(tmp_path / "bands_R.exr")
    ]  # fmt: skip


def test_render_tells_the_notes_of_every_view_layer(saved, tmp_path, capfd):
    bpy.context.scene.view_layers["ViewLayer"].use_freestyle = True
    bpy.context.scene.view_layers.new("Last")
    bpy.context.scene.view_layers["Last"].use_freestyle = False
    bpy.context.scene.render.use_freestyle = True
    bpy.ops.wm.save_mainfile()
    status, text, _ = call(capfd, "render", saved, "--out", tmp_path / "notes.png", "--json")
    notes = [each for each in json.loads(text.splitlines()[-1])["notes"] if "Freestyle" in each]
    assert status == 0 and len(notes) == 1 and notes[0].startswith("ViewLayer: Blender itself draws Freestyle lines")


def test_render_writes_passes_as_layers(saved, tmp_path, capfd):
    OpenEXR = pytest.importorskip("OpenEXR")
    out = tmp_path / "layers.exr"
    status, text, _ = call(capfd, "render", saved, "--out", out, "--passes", "Depth", "Diffuse Direct", "--json")
    assert status == 0 and json.loads(text.splitlines()[-1])["frames"][0]["passes"] == ["Depth", "Diffuse Direct"]
    with OpenEXR.File(str(out), separate_channels=True) as file:
        names = {channel for part in file.parts for channel in part.channels}
        depth = next(np.array(p.channels[n].pixels) for p in file.parts for n in p.channels if n.endswith("Depth.Z"))
    assert {"ViewLayer.Combined.R", "ViewLayer.Depth.Z", "ViewLayer.Diffuse Direct.G"} <= names
    np.testing.assert_allclose(depth, 5.0, rtol=1e-5)
    for wrong, message in (
        (("--out", tmp_path / "a.png", "--multilayer"), "passes fit into an .exr only"),
        (("--out", out, "--multilayer", "--bands", "4"), "request one of them"),
        (("--out", out, "--passes", "Dept"), "Dept"),
    ):
        status, _, error = call(capfd, "render", saved, *wrong)
        assert status == 1 and message in error


def test_a_multilayer_file_that_blender_refuses_for_its_pixels_says_so(saved, tmp_path, capfd):
    bpy.context.scene.render.pixel_aspect_x = 2.0
    bpy.ops.wm.save_mainfile()
    out = tmp_path / "wide.exr"
    status, _, error = call(capfd, "render", saved, "--out", out, "--passes", "Depth")
    if status == 0:
        pytest.skip("this Blender writes such files")
    assert "its pixels are 2 by 1" in error and not out.exists()
    assert call(capfd, "render", saved, "--out", out)[0] == 0


def test_render_denoises_on_request_if_the_package_is_installed(saved, tmp_path, capfd):
    from spectral_core.render.denoise import is_installed

    out = tmp_path / "clean.exr"
    status, text, error = call(capfd, "render", saved, "--out", out, "--bands", 3, "--denoise", "--json")
    if not is_installed():
        assert status == 1 and "install it with" in error and not out.exists()
        return
    report = json.loads(text.splitlines()[-1])
    assert status == 0 and report["frames"][0]["denoised"].startswith("Open Image Denoise (pyoidn ")
    assert "denoised by Open Image Denoise" in text
    from spectral_core.files.exr import openexr

    header = openexr().File(str(out), header_only=True).header()
    assert header["spectral.denoised"] == report["frames"][0]["denoised"]
    bpy.context.scene.spectral.render.denoise = True
    bpy.ops.wm.save_mainfile()
    status, text, _ = call(capfd, "render", saved, "--out", tmp_path / "raw.png", "--no-denoise", "--json")
    assert status == 0 and json.loads(text.splitlines()[-1])["frames"][0]["denoised"] == ""


@pytest.mark.parametrize("mute", [False, True])
def test_render_shows_the_scene_and_names_strips_that_f12_shows_instead(saved, tmp_path, capfd, mute):
    editor = bpy.context.scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    length = "length" if "length" in strips.bl_rna.functions["new_effect"].parameters else "frame_end"
    strips.new_effect(name="Color", type="COLOR", channel=1, frame_start=1, **{length: 25}).mute = mute
    bpy.ops.wm.save_mainfile()
    out = tmp_path / "scene.exr"
    status, text, _ = call(capfd, "render", saved, "--out", out, "--json")
    report = json.loads(text.splitlines()[-1])
    assert status == 0 and report["frames"][0]["samples"] == 3
    assert sum(note.startswith("Sequencer: ") for note in report["notes"]) == (0 if mute else 1)
    image = bpy.data.images.load(str(out))
    np.testing.assert_allclose(np.array(image.pixels[:]).reshape(-1, 4)[:, :3], 0.5, rtol=0.02)


def test_plan_prints_reasons(saved, capfd):
    status, text, _ = call(capfd, "plan", saved, "--set", "bounces=3", "--json")
    rows = {row["effect"]: row for row in json.loads(text.splitlines()[-1])["plan"]}
    assert status == 0 and rows["transport"]["value"] == "rgb" and rows["bounces"]["value"] == "3"
    assert rows["bounces"]["decided_by"] == "artist" and all(row["reason"] for row in rows.values())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["render", "absent.blend"], "there is no file"),
        (["render", "SCENE", "--out", "picture.xyz"], "--out: picture.xyz ends in '.xyz'; expected a picture's name"),
        (["render", "SCENE", "--bands", "7"], "spectral bands fit into an .exr only; scene.png is none"),
        (["render", "SCENE", "--samples", "0"], "--samples is 0; expected a number from 1 to 2147483647"),
        (["render", "SCENE", "--seed", "3000000000"], "--seed is 3000000000; expected a number from 0 to 2147483647"),
        (["render", "SCENE", "--percentage", "100000"], "--percentage is 100000; expected a number from 1 to 32767"),
        (["render", "SCENE", "--target-error", "4e3"], "--target-error is 4000; expected a number from 0.02 to 100"),
        (["plan", "SCENE", "--percentage", "0"], "--percentage is 0; expected a number from 1 to 32767"),
        (["render", "SCENE", "--frame", "9999999"], "--frame is 9999999; Blender stops at -1048574 and 1048574"),
        (["render", "SCENE", "--frame", "9999999999"], "--frame is 9999999999; Blender stops at -1048574 and"),
        (["render", "SCENE", "--write-mitsuba", "FOLDER", "--frame", "2000000"], "--frame is 2000000; Blender stops"),
        (["render", "SCENE", "--set", "bounces"], "is not of the form EFFECT=VALUE"),
        (["plan", "SCENE", "--set", "bounce=3"], "no effect is named 'bounce'; did you mean 'bounces'"),
        (["render", "TEXT"], "notes.blend cannot be opened"),
    ],
)
def test_wrong_input_gives_one_line_and_status_1(saved, tmp_path, capfd, arguments, message):
    text_file = tmp_path / "notes.blend"
    text_file.write_text("this is no Blender file")
    places = {"SCENE": saved, "TEXT": text_file, "FOLDER": tmp_path / "mitsuba"}
    status, out, error = call(capfd, *[places.get(word, word) for word in arguments], "--json")
    assert status == 1 and message in error.splitlines()[-1]
    assert message in json.loads(out.splitlines()[-1])["error"]


def test_without_bpy_the_message_names_the_package_to_install(saved, capfd, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "bpy", None)
    status, _, error = call(capfd, "render", saved)
    assert status == 1 and "pip install 'spectral-scene[blender]'" in error


def test_render_writes_a_scene_for_mitsuba(saved, tmp_path, capfd):
    folder = tmp_path / "out" / "scene"
    status, text, _ = call(capfd, "render", saved, "--write-mitsuba", folder, "--json")
    report = json.loads(text.splitlines()[-1])
    assert status == 0 and report["scene"] == str(folder / "scene.xml")
    assert sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()) == sorted(
        report["files"]
    )
    assert "meshes/Plane.ply" in report["files"] and any(note.startswith("Film: ") for note in report["notes"])
    status, _, error = call(capfd, "render", saved, "--write-mitsuba", tmp_path)
    assert status != 0 and "scene.blend" in error and not (tmp_path / "scene.xml").exists()
    status, _, error = call(capfd, "render", saved, "--write-mitsuba", folder, "--out", tmp_path / "a.png")
    assert status != 0 and "--out" in error
    assert bpy.ops.spectral.write_mitsuba(directory=str(tmp_path / "button")) == {"FINISHED"}
    assert (tmp_path / "button" / "scene.xml").is_file()
