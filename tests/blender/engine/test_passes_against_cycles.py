# SPDX-License-Identifier: GPL-3.0-or-later
"""Every pass of a small scene compared with Cycles, as multilayer EXR and in Blender's render result."""

from __future__ import annotations

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba")
OpenEXR = pytest.importorskip("OpenEXR")

from tests.blender.cycles import settings as small_picture  # noqa: E402

SIZE, SAMPLES = 32, 64
TICKS = (
    "z", "mist", "position", "normal", "uv", "object_index", "material_index", "diffuse_direct", "diffuse_indirect",
    "diffuse_color", "glossy_direct", "glossy_indirect", "glossy_color", "transmission_direct",
    "transmission_indirect", "transmission_color", "emit", "environment", "cryptomatte_object",
    "cryptomatte_material", "cryptomatte_asset",
)  # fmt: skip


def stage(build):
    """A floor, a glossy ball, a glass pane, an emissive square and an AOV, under a lamp and a world in light groups."""
    from blender_addon import compat

    scene, layer = bpy.context.scene, bpy.context.view_layer
    floor = build.plane("Floor", 8.0, build.material("Matt", Color=(0.6, 0.4, 0.2, 1.0)))
    floor.pass_index, floor.data.materials[0].pass_index = 3, 7
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8, location=(-1.2, 0, 0.8))
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    ball.data.materials.append(
        build.material("Gloss", "ShaderNodeBsdfPrincipled", Base_Color=(0.1, 0.4, 0.7, 1), Roughness=0.4)
    )
    ball.pass_index = 4
    pane = build.plane("Pane", 1.6, build.material("Glass", "ShaderNodeBsdfGlass", Roughness=0.0, IOR=1.2))
    pane.location, pane.rotation_euler = (1.3, -0.6, 0.9), (1.4, 0, 0)
    glow = build.plane("Glow", 1.0, build.material("Glow", "ShaderNodeEmission", Color=(1, 0.7, 0.3, 1), Strength=3.0))
    glow.location, glow.rotation_euler = (0.6, 2.2, 1.2), (1.57, 0, 0)
    glow.parent = floor
    tree = compat.use_nodes(ball.data.materials[0])
    for name, kind in (("tone", "COLOR"), ("mark", "VALUE")):
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
        node = tree.nodes.new("ShaderNodeOutputAOV")
        node.aov_name = name
        node.inputs["Color"].default_value, node.inputs["Value"].default_value = (0.2, 0.5, 0.9, 1), 0.75
    lamp = build.light("AREA", energy=150.0, location=(1.0, -1.0, 4.0), size=1.5)
    world = scene.world = bpy.data.worlds.new("World")
    compat.use_nodes(world).nodes["Background"].inputs[0].default_value = (0.3, 0.35, 0.5, 1)
    world.mist_settings.start, world.mist_settings.depth = 3.0, 8.0
    for name in ("key", "sky"):
        layer.lightgroups.add(name=name)
    lamp.lightgroup, world.lightgroup = "key", "sky"
    camera = build.camera(location=(0, -6, 3.5))
    camera.rotation_euler = (1.1, 0, 0)
    for tick in TICKS:
        setattr(layer, f"use_pass_{tick}", True)
    layer.cycles.pass_debug_sample_count = True
    layer.pass_cryptomatte_depth = 4


def rendered(tmp_path, engine):
    """Channels (height, width, n) of each pass in the file, row 0 at the top, and the file's header."""
    from blender_addon import compat

    scene = bpy.context.scene
    scene.render.engine = engine
    scene.spectral.render.samples, scene.spectral.render.transport = SAMPLES, "RGB"
    compat.set_image_format(scene.render.image_settings, "OPEN_EXR_MULTILAYER", color_depth="32")
    scene.render.filepath = str(tmp_path / f"{engine}.exr")
    bpy.ops.render.render(write_still=True)
    passes, header = {}, {}
    with OpenEXR.File(scene.render.filepath, separate_channels=True) as file:
        for part in file.parts:
            header |= {key: value for key, value in part.header.items() if isinstance(value, str)}
            for channel, data in part.channels.items():
                name, _, letter = channel.partition(".")[2].rpartition(".")
                passes.setdefault(name, {})[letter] = np.array(data.pixels, np.float32)
    order = "RGBAXYZWUVrgba"
    stacked = {name: np.stack([of[k] for k in sorted(of, key=order.index)], axis=-1) for name, of in passes.items()}
    return stacked, header


@pytest.fixture(scope="module")
def both(_extension, tmp_path_factory):
    """The files of the same scene by Cycles and by this renderer."""
    from types import SimpleNamespace

    from tests.blender import conftest

    bpy.ops.wm.read_factory_settings(use_empty=True)
    build = SimpleNamespace(
        plane=conftest._plane, material=conftest._material, light=conftest._light, camera=conftest._camera
    )
    small_picture(SAMPLES, SIZE)
    stage(build)
    folder = tmp_path_factory.mktemp("passes")
    return rendered(folder, "CYCLES"), rendered(folder, "SPECTRAL")


def test_the_same_passes_are_in_the_file(both):
    (theirs, _), (ours, _) = both
    assert set(ours) == set(theirs)
    assert {name: picture.shape for name, picture in ours.items()} == {n: p.shape for n, p in theirs.items()}


@pytest.mark.parametrize(
    "name", ["Depth", "Mist", "Position", "Normal", "UV", "Object Index", "Material Index", "tone", "mark"]
)
def test_data_passes_equal_those_of_cycles(both, name):
    """Equal except at edges, where pixels depend on random numbers."""
    (theirs, _), (ours, _) = both
    scale = 1.0 if name != "Depth" else 0.01
    apart = np.abs(ours[name] - theirs[name]).max(axis=-1) * scale
    assert np.quantile(apart, 0.8) < (0.2 if name == "Position" else 0.02)
    assert np.mean(apart > 0.2) < 0.12
    assert ours[name].max() > 0


@pytest.mark.parametrize("name", ["Diffuse Color", "Glossy Color", "Transmission Color"])
def test_color_passes_equal_those_of_cycles(both, name):
    (theirs, _), (ours, _) = both
    assert np.abs(ours[name] - theirs[name]).mean() < 0.02
    assert abs(ours[name].mean() - theirs[name].mean()) < 0.05 * theirs[name].mean() + 0.002


@pytest.mark.parametrize(
    "name",
    [
        "Combined", "Diffuse Direct", "Diffuse Indirect", "Glossy Direct", "Glossy Indirect", "Transmission Direct",
        "Transmission Indirect", "Emission", "Environment", "Combined_key", "Combined_sky",
    ],
)  # fmt: skip
def test_light_passes_equal_those_of_cycles(both, name):
    """Compares means over blocks of 8 by 8 pixels, which have little noise."""
    blocks = []
    for passes, _ in both:
        picture = passes[name][..., :3]
        if name.endswith("rect"):  # the pass is light divided by the lobe's color: the picture holds their product
            picture = picture * passes[f"{name.partition(' ')[0]} Color"]
        blocks.append(picture.reshape(SIZE // 8, 8, SIZE // 8, 8, 3).mean(axis=(1, 3)))
    apart = np.abs(blocks[0] - blocks[1])
    assert apart.mean() < 0.04 * blocks[0].mean() + 0.004, (apart.mean(), blocks[0].mean(), blocks[1].mean())


def test_shares_add_up_to_the_picture(both):
    _, (ours, _) = both
    total = ours["Emission"] + ours["Environment"]
    for lobe in ("Diffuse", "Glossy", "Transmission"):
        total = total + ours[f"{lobe} Color"] * (ours[f"{lobe} Direct"] + ours[f"{lobe} Indirect"])
    assert np.quantile(np.abs(total - ours["Combined"][..., :3]), 0.97) < 5e-3


def test_cryptomattes_hold_the_same_names_with_the_same_coverage(both):
    (theirs, their_header), (ours, our_header) = both
    manifests = [
        {
            header[key.replace("manifest", "name")]: json.loads(value)
            for key, value in header.items()
            if key.startswith("cryptomatte/") and key.endswith("/manifest")
        }
        for header in (their_header, our_header)
    ]
    assert set(manifests[1]) == set(manifests[0])
    for layer, names in manifests[1].items():
        assert names.items() <= manifests[0][layer].items()
    for kind in ("CryptoObject", "CryptoMaterial", "CryptoAsset"):
        covered = []
        for passes in (theirs, ours):
            found = {}
            for k in range(2):
                picture = passes[f"{kind}{k:02d}"]
                for rank in (0, 2):
                    for name in np.unique(picture[..., rank]):
                        share = np.where(picture[..., rank] == name, picture[..., rank + 1], 0).mean()
                        found[float(name)] = found.get(float(name), 0.0) + float(share)
            covered.append({name: share for name, share in found.items() if share > 0.005 and name != 0})
        assert set(covered[0]) == set(covered[1])
        assert all(abs(covered[0][name] - covered[1][name]) < 0.01 for name in covered[0])


def test_an_unsupported_pass_gets_a_note_and_only_selected_passes_are_rendered(build):
    from blender_addon.translate.passes import pass_notes, passes_of

    layer = bpy.context.view_layer
    layer.use_pass_vector = layer.use_pass_ambient_occlusion = True
    layer.cycles.use_pass_volume_scatter = True
    (note,) = pass_notes(layer)
    assert all(name in note.message for name in ("Vector", "Ambient Occlusion", "Volume Scatter", "not rendered"))
    assert passes_of(bpy.context.scene, layer) is None
    layer.use_pass_mist = True
    assert passes_of(bpy.context.scene, layer).names == ("Mist",)


def test_the_compositor_has_a_socket_for_each_selected_pass(build):
    layer = bpy.context.view_layer
    bpy.context.scene.render.engine = "SPECTRAL"
    layer.use_pass_normal = layer.use_pass_glossy_indirect = layer.use_pass_cryptomatte_object = True
    layer.aovs.add().name = "tone"
    layer.lightgroups.add(name="key")
    layer.update_render_passes()
    if hasattr(bpy.context.scene, "compositing_node_group"):
        tree = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        bpy.context.scene.compositing_node_group = tree
    else:
        bpy.context.scene.use_nodes = True
        tree = bpy.context.scene.node_tree
    sockets = {socket.name for socket in tree.nodes.new("CompositorNodeRLayers").outputs if socket.enabled}
    assert {"Image", "Normal", "CryptoObject00", "tone", "Combined_key"} <= sockets
    assert sockets & {"Glossy Indirect", "GlossInd"}
    assert not sockets & {"Depth", "Diffuse Direct", "DiffDir"}


@pytest.mark.parametrize("name", ["Depth", "Position", "Object Index", "Material Index"])
def test_passes_of_one_ray_show_the_middle_of_each_pixel(both, name):
    """A ray anywhere in the pixel made edges ragged and planes rough: 3 % of a depth differed."""
    (theirs, _), (ours, _) = both
    apart = np.abs(ours[name] - theirs[name]).max(axis=-1)
    assert np.mean(apart > 1e-3 + 1e-3 * np.abs(theirs[name]).max(axis=-1)) < 0.01


def test_a_mesh_without_a_uv_map_has_no_uv_pass(build, tmp_path):
    """A map whose coordinates are all zero has one, as in Cycles."""
    for x, name in ((-0.7, "Mapped"), (0.7, "Plain")):
        plane = build.plane(name, 1.0)
        plane.location.x = x
        layers = plane.data.uv_layers
        while layers:
            layers.remove(layers[0])
        if name == "Mapped":
            layers.new(name="UVMap").uv.foreach_set("vector", np.zeros(8, np.float32))
    build.camera((0, 0, 5.0))
    small_picture(16, 24)
    bpy.context.view_layer.use_pass_uv = True
    (theirs, _), (ours, _) = rendered(tmp_path, "CYCLES"), rendered(tmp_path, "SPECTRAL")
    assert theirs["UV"].max() > 0.9
    assert np.abs(ours["UV"] - theirs["UV"]).mean() < 0.01


@pytest.mark.parametrize("kind", ["FISHEYE_EQUISOLID", "MIRRORBALL"])
def test_outside_of_the_circle_of_a_panorama_the_passes_are_empty(build, tmp_path, kind):
    """The pass of the environment and the world's light group were full there."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    build.plane(size=1.0)
    scene.world = bpy.data.worlds.new("World")
    layer.lightgroups.add(name="sky")
    scene.world.lightgroup = "sky"
    camera = build.camera((0, 0, 5.0)).data
    camera.type, camera.panorama_type, camera.fisheye_lens, camera.fisheye_fov = "PANO", kind, 10.0, 2.0
    small_picture(16, 24)
    layer.use_pass_environment = True
    (theirs, _), (ours, _) = rendered(tmp_path, "CYCLES"), rendered(tmp_path, "SPECTRAL")
    for name in ("Environment", "Combined_sky", "Combined"):
        assert theirs[name][0, 0, :3].max() == 0
        assert np.abs(ours[name] - theirs[name])[..., :3].mean() < 0.02 * theirs[name][..., :3].mean() + 1e-3, name


def test_light_reflected_below_a_coarse_surface_is_glossy_not_transmitted(build, tmp_path):
    """Normals that lean away from the surface's send reflected light below it: it was in the passes of Transmission."""
    bpy.ops.mesh.primitive_cube_add(size=1.5)
    cube = bpy.context.object
    cube.data.polygons.foreach_set("use_smooth", np.ones(6, bool))
    cube.rotation_euler = (0.6, 0.3, 0.2)
    cube.data.materials.append(build.material("Gloss", "ShaderNodeBsdfGlossy", Roughness=0.3))
    bpy.context.scene.world = bpy.data.worlds.new("World")
    build.camera((0, 0, 5.0))
    small_picture(64, 24)
    layer = bpy.context.view_layer
    for part in ("direct", "indirect", "color"):
        setattr(layer, f"use_pass_glossy_{part}", True)
        setattr(layer, f"use_pass_transmission_{part}", True)
    (theirs, _), (ours, _) = rendered(tmp_path, "CYCLES"), rendered(tmp_path, "SPECTRAL")
    for part in ("Direct", "Indirect", "Color"):
        assert not theirs[f"Transmission {part}"].any()
        assert not ours[f"Transmission {part}"].any(), part
    assert abs(ours["Glossy Color"].mean() / theirs["Glossy Color"].mean() - 1) < 0.05
