# SPDX-License-Identifier: GPL-3.0-or-later
"""Plain RGB scenes against Cycles: a gray plane under each light, and shiny materials; luminance and pixel errors.

Both engines render the same scene in the same Blender, unclamped, undenoised, with all caustics, to the same size.
"relative difference" is of the mean luminance; "mean relative error" is the mean absolute difference of pixels over
the mean, which is never below the noise of the two renders. The noise of each is printed beside it: the same error
between two renders of Cycles with other seeds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks.render.features.compare import render
from spectral_core.errors import UnknownNameError
from spectral_core.spectra.color import luminance_from_linear_rgb

WORDS = "SCENE…"
NOISE_OF_MEANS = 0.1
"""Noise of a picture's mean over that of its pixels, three standard deviations; a picture has 576 pixels or more."""


def run(options: Options) -> dict[str, Any]:
    """Print the table and return it."""
    import blender_addon

    blender_addon.register_once()
    known = LIGHTS | MATERIALS
    wanted = options.extra or list(known)
    for name in wanted:
        if name not in known:
            raise UnknownNameError.among("scene", name, known)
    figures: dict[str, Any] = {}
    print(f"{'scene':28} {'Cycles':>9} {'ours':>9} {'difference':>11} {'pixel error':>12} {'noise':>7}")
    for name in wanted:
        is_light = name in LIGHTS
        empty_scene(samples=16 if options.quick else 256 if is_light else 1024, size=24 if is_light else 64)
        known[name]()
        figures[name] = row = _compare()
        print(
            f"{name:28} {row['cycles']:9.5f} {row['ours']:9.5f} {row['relative_difference']:+10.2%} "
            f"{row['mean_relative_error']:11.2%} {row['noise']:7.2%}"
        )
    lights = [figures[name] for name in wanted if name in LIGHTS]
    materials = [figures[name] for name in wanted if name in MATERIALS]
    return {
        "scenes": figures,
        "worst_light_difference": max((abs(row["relative_difference"]) for row in lights), default=0.0),
        "worst_material_error": max((row["mean_relative_error"] for row in materials), default=0.0),
        "holds": {
            f"mean luminance under {what} agrees within {limit:.1%}, beyond the noise of Cycles": all(
                abs(row["relative_difference"]) <= limit + NOISE_OF_MEANS * row["noise"] for row in rows
            )
            for what, limit, rows in (("lights", 0.001, lights), ("materials", 0.002, materials))
            if rows
        },
    }


def _compare() -> dict[str, float]:
    cycles = [_luminance("CYCLES", seed) for seed in (1, 2)]
    ours = _luminance("SPECTRAL", 1)
    both = (cycles[0] + cycles[1]) / 2
    return {
        "cycles": float(both.mean()),
        "ours": float(ours.mean()),
        "relative_difference": float(ours.mean() / both.mean() - 1),
        "mean_relative_error": float(np.abs(ours - both).mean() / both.mean()),
        "noise": float(np.abs(cycles[0] - cycles[1]).mean() / both.mean()),
    }


def _luminance(engine: str, seed: int) -> NDArray[np.float64]:
    """Render with an engine: luminance (height, width)."""
    return luminance_from_linear_rgb(render(engine, seed, raw=True)[..., :3])


def empty_scene(samples: int, size: int) -> None:
    """A scene without anything, Cycles set to hide nothing."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.spectral.render.samples = scene.cycles.samples = samples
    cycles = scene.cycles
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 24
    cycles.transparent_max_bounces = 24
    bounces = scene.spectral.render.overrides.add()
    bounces.name, bounces.value = "bounces", "24"


def new_object(name: str, data: Any, location: tuple[float, float, float] = (0, 0, 0)) -> Any:
    import bpy

    made = bpy.data.objects.new(name, data)
    made.location = location
    bpy.context.scene.collection.objects.link(made)
    return made


def camera(location: tuple[float, float, float], rotation: tuple[float, float, float], lens: float = 50) -> None:
    import bpy

    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    made = new_object("Camera", data, location)
    made.rotation_euler = rotation
    bpy.context.scene.camera = made


def new_material(shader: str, **inputs: Any) -> Any:
    import bpy

    from blender_addon import compat

    made = bpy.data.materials.new(shader)
    tree = compat.use_nodes(made)
    tree.nodes.clear()
    node, output = tree.nodes.new(shader), tree.nodes.new("ShaderNodeOutputMaterial")
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return made


def plane(size: float, gray: float = 0.5) -> None:
    import bpy

    data = bpy.data.meshes.new("Plane")
    half = size / 2
    data.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    data.materials.append(new_material("ShaderNodeBsdfDiffuse", Color=(gray, gray, gray, 1)))
    new_object("Plane", data)


def light(kind: str, energy: float, **values: Any) -> None:
    import bpy

    data = bpy.data.lights.new(kind, kind)
    data.energy = energy
    for name, value in values.items():
        setattr(data, name, value)
    made = new_object(kind, data, (0.4, -0.3, 1.5))
    made.rotation_euler = (0.25, 0.15, 0.4)


def new_world(color: tuple[float, float, float], image: Any = None, turn: float = 0.0) -> None:
    import bpy

    from blender_addon import compat

    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    tree = compat.use_nodes(world)
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*color, 1)
    if image is not None:
        texture, mapping = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeMapping")
        texture.image = image
        mapping.inputs["Rotation"].default_value = (0.3, 0.2, turn)
        place = tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
        tree.links.new(texture.outputs["Color"], background.inputs["Color"])


def sky() -> Any:
    """An environment with a bright patch, colored, brighter above."""
    import bpy

    height, width = 64, 128
    v, u = np.mgrid[0:height, 0:width] / np.array([height, width]).reshape(2, 1, 1)
    red = 0.2 + 0.8 * v + 20 * np.exp(-(((u - 0.3) / 0.05) ** 2 + ((v - 0.8) / 0.08) ** 2))
    pixels = np.stack([red, 0.3 + 0.5 * v + 0 * u, 0.6 - 0.3 * u, np.ones_like(u)], axis=-1).astype(np.float32)
    image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()  # Blender frees the pixels of generated images after a render
    return image


def _under(build: Callable[[], None]) -> Callable[[], None]:
    """A gray plane seen from above under a light."""

    def scene() -> None:
        plane(20)
        camera((0, 0, 4), (0, 0, 0))
        build()

    return scene


def _ball(shader: str, **inputs: Any) -> Callable[[], None]:
    """A ball of a material on a gray plane under an area light and a colored sky."""

    def scene() -> None:
        import bpy

        plane(12)
        bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, location=(0, 0, 1))
        ball = bpy.context.object
        ball.data.polygons.foreach_set("use_smooth", np.ones(len(ball.data.polygons), dtype=bool))
        ball.data.materials.append(new_material(shader, **inputs))
        camera((0, -5.5, 2.2), (1.35, 0, 0), 60)
        light("AREA", 60, size=1.5)
        bpy.data.objects["AREA"].location = (1.5, -2.0, 4.0)
        bpy.data.objects["AREA"].rotation_euler = (0.5, 0.3, 0)
        new_world((1, 1, 1), sky(), 0.5)

    return scene


LIGHTS: dict[str, Callable[[], None]] = {
    "point": _under(lambda: light("POINT", 50, shadow_soft_size=0.0)),
    "point with radius": _under(lambda: light("POINT", 50, shadow_soft_size=0.3)),
    "spot": _under(lambda: light("SPOT", 50, shadow_soft_size=0.0, spot_size=1.2, spot_blend=0.4)),
    "spot with radius": _under(lambda: light("SPOT", 50, shadow_soft_size=0.2, spot_size=1.2, spot_blend=0.4)),
    "sun": _under(lambda: light("SUN", 2, angle=0.01)),
    "wide sun": _under(lambda: light("SUN", 2, angle=0.6)),
    "area square": _under(lambda: light("AREA", 50, size=0.8)),
    "area rectangle": _under(lambda: light("AREA", 50, shape="RECTANGLE", size=0.4, size_y=1.5)),
    "area disk": _under(lambda: light("AREA", 50, shape="DISK", size=0.8)),
    "area ellipse": _under(lambda: light("AREA", 50, shape="ELLIPSE", size=0.4, size_y=1.5)),
    "area with spread": _under(lambda: light("AREA", 50, size=0.8, spread=1.0)),
    "world color": _under(lambda: new_world((0.3, 0.5, 0.7))),
    "world image": _under(lambda: new_world((1, 1, 1), sky(), 0.7)),
}

BASE = (0.7, 0.3, 0.15, 1)
MATERIALS: dict[str, Callable[[], None]] = {
    "principled": _ball("ShaderNodeBsdfPrincipled", Base_Color=BASE),
    "principled smooth": _ball("ShaderNodeBsdfPrincipled", Base_Color=BASE, Roughness=0.15),
    "principled metal": _ball("ShaderNodeBsdfPrincipled", Base_Color=BASE, Metallic=1.0, Roughness=0.3),
    "principled coat": _ball("ShaderNodeBsdfPrincipled", Base_Color=BASE, Coat_Weight=1.0, Coat_Roughness=0.1),
    "principled glass": _ball(
        "ShaderNodeBsdfPrincipled", Transmission_Weight=1.0, Roughness=0.1, Base_Color=(1, 1, 1, 1)
    ),
    "glossy rough": _ball("ShaderNodeBsdfAnisotropic", Color=BASE, Roughness=0.5),
    "glossy": _ball("ShaderNodeBsdfAnisotropic", Color=BASE, Roughness=0.2),
    "mirror": _ball("ShaderNodeBsdfAnisotropic", Color=BASE, Roughness=0.0),
    "glass": _ball("ShaderNodeBsdfGlass", Roughness=0.0, IOR=1.45),
    "rough glass": _ball("ShaderNodeBsdfGlass", Roughness=0.3, IOR=1.45),
    "diffuse": _ball("ShaderNodeBsdfDiffuse", Color=BASE),
}
