# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage of the single-feature scenes: a ball on a plane, an area light, a dim sky; and short ways to change it."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from blender_addon import compat

WIDTH, HEIGHT = 64, 48
BALL_RADIUS = 1.0


def match_settings(scene: Any, samples: int) -> None:
    """The same samples and bounces for both renderers, and nothing that Cycles leaves out or smooths by default."""
    cycles = scene.cycles
    scene.view_settings.view_transform = "Standard"
    scene.spectral.render.samples = cycles.samples = samples
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.light_sampling_threshold = 0
    for name in ("max", "diffuse", "glossy", "transmission", "transparent_max", "volume"):
        setattr(cycles, f"{name}_bounces", 24)


class Stage:
    """A new scene. The parts that a feature changes are attributes: ``ball``, ``floor``, ``lamp``, ``world``, …"""

    def __init__(self, samples: int) -> None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene
        self.layer = bpy.context.view_layer
        self.scene.render.resolution_x, self.scene.render.resolution_y = WIDTH, HEIGHT
        match_settings(self.scene, samples)
        self.floor = self.plane(12.0, self.material("Floor", Color=(0.5, 0.5, 0.5, 1)))
        self.floor.name = "Floor"
        self.material_of_ball = self.material("Ball", Color=(0.7, 0.35, 0.2, 1))
        self.ball = self.sphere(self.material_of_ball, (0, 0, BALL_RADIUS))
        self.lamp = self.light("AREA", 90.0, (1.8, -2.2, 4.0), (0.5, 0.35, 0.0), size=1.2)
        self.camera = self._camera()
        self.set_world((0.25, 0.3, 0.36))

    def _camera(self) -> Any:
        data = bpy.data.cameras.new("Camera")
        data.lens = 60
        made = self.object("Camera", data, (0.0, -6.0, 2.4), (1.35, 0.0, 0.0))
        self.scene.camera = made
        return made

    # --- parts -------------------------------------------------------------------------------------------------

    def object(self, name: str, data: Any, location: Any = (0, 0, 0), rotation: Any = (0, 0, 0)) -> Any:
        """A new object of some data, linked into the scene."""
        made = bpy.data.objects.new(name, data)
        made.location, made.rotation_euler = location, rotation
        self.scene.collection.objects.link(made)
        return made

    def plane(self, size: float, material: Any, location: Any = (0, 0, 0), rotation: Any = (0, 0, 0)) -> Any:
        """A square with a UV map."""
        half = size / 2
        data = bpy.data.meshes.new("Plane")
        data.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
        data.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
        data.materials.append(material)
        return self.object("Plane", data, location, rotation)

    def sphere(self, material: Any, location: Any, radius: float = BALL_RADIUS, *, smooth: bool = True) -> Any:
        """A UV sphere with a UV map."""
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=radius, location=location)
        made = bpy.context.object
        made.data.polygons.foreach_set("use_smooth", np.full(len(made.data.polygons), smooth))
        made.data.materials.append(material)
        return made

    def cube(self, material: Any, location: Any, size: float = 1.0, rotation: Any = (0, 0, 0)) -> Any:
        """A cube."""
        bpy.ops.mesh.primitive_cube_add(size=size, location=location, rotation=rotation)
        made = bpy.context.object
        made.data.materials.append(material)
        return made

    def light(self, kind: str, energy: float, location: Any, rotation: Any = (0, 0, 0), **values: Any) -> Any:
        """A lamp object."""
        data = bpy.data.lights.new(kind.title(), kind)
        data.energy = energy
        for name, value in values.items():
            setattr(data, name, value)
        return self.object(kind.title(), data, location, rotation)

    def replace_lamp(self, kind: str, energy: float, **values: Any) -> Any:
        """Another lamp at the position of the stage's; the sky is removed, so that only the lamp is compared."""
        location, rotation = self.lamp.location.copy(), self.lamp.rotation_euler.copy()
        bpy.data.objects.remove(self.lamp)
        self.lamp = self.light(kind, energy, location, rotation, **values)
        self.set_world((0, 0, 0))
        return self.lamp

    def instance_at(self, item: Any, places: Any) -> None:
        """Show an object as collection instances at some x, instead of itself."""
        group = bpy.data.collections.new(f"{item.name} instances")
        self.scene.collection.objects.unlink(item)
        group.objects.link(item)
        for x in places:
            empty = self.object(f"Empty {x}", None, (x, 0, 0))
            empty.instance_type, empty.instance_collection = "COLLECTION", group

    # --- nodes -------------------------------------------------------------------------------------------------

    def material(self, name: str, shader: str = "ShaderNodeBsdfDiffuse", **inputs: Any) -> Any:
        """A material of one shader node named "shader"; its inputs by name, ``_`` for a space."""
        made = bpy.data.materials.new(name)
        tree = compat.use_nodes(made)
        tree.nodes.clear()
        node, output = tree.nodes.new(shader), tree.nodes.new("ShaderNodeOutputMaterial")
        node.name, output.name = "shader", "output"
        for key, value in inputs.items():
            node.inputs[key.replace("_", " ")].default_value = value
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        return made

    def tree(self, owner: Any = None) -> Any:
        """Node tree of a material (the ball's by default), lamp or world."""
        return compat.use_nodes(self.material_of_ball if owner is None else owner)

    def shader(self, kind: str, **inputs: Any) -> Any:
        """The ball's material made of one shader; returns the node."""
        tree = self.tree()
        tree.nodes.remove(tree.nodes["shader"])
        node = tree.nodes.new(kind)
        node.name = "shader"
        for key, value in inputs.items():
            node.inputs[key.replace("_", " ")].default_value = value
        tree.links.new(node.outputs[0], tree.nodes["output"].inputs["Surface"])
        return node

    def node(self, kind: str, owner: Any = None, **values: Any) -> Any:
        """A new node (in the ball's tree), its properties and, where no property is named so, its inputs set."""
        node = self.tree(owner).nodes.new(kind)
        for key, value in values.items():
            if key in node.bl_rna.properties:
                setattr(node, key, value)
            else:
                node.inputs[key.replace("_", " ")].default_value = value
        return node

    def link(self, output: Any, target: Any) -> None:
        """A link between two sockets of one tree."""
        output.id_data.links.new(output, target)

    def into_color(self, output: Any) -> None:
        """An output into the color of the ball's shader."""
        shader = self.tree().nodes["shader"]
        self.link(output, shader.inputs[0])

    def glow(self, output: Any) -> None:
        """The ball emits the value of an output, so that the picture shows the value itself."""
        shader = self.shader("ShaderNodeEmission")
        self.link(output, shader.inputs["Color"])

    def set_world(self, color: tuple[float, float, float], strength: float = 1.0) -> Any:
        """A world of one color; returns its Background node."""
        world = bpy.data.worlds.new("World")
        self.scene.world = self.world = world
        background = next(node for node in compat.use_nodes(world).nodes if node.type == "BACKGROUND")
        background.inputs["Color"].default_value = (*color, 1)
        background.inputs["Strength"].default_value = strength
        return background

    def image(
        self, name: str = "Image", size: tuple[int, int] = (16, 16), *, alpha: bool = False, **options: Any
    ) -> Any:
        """A colored test picture with soft changes and one hard edge, as bytes or (``float_buffer``) floats."""
        width, height = size
        v, u = np.mgrid[0:height, 0:width] / np.array([height, width]).reshape(2, 1, 1)
        coverage = np.where(u < 0.5, 0.35, 0.9) if alpha else np.ones_like(u)
        pixels = np.stack([0.2 + 0.7 * u, 0.8 - 0.6 * v, np.where(v > 0.5, 0.7, 0.15), coverage], -1)
        made = bpy.data.images.new(name, width, height, alpha=alpha, **options)
        made.pixels.foreach_set(pixels.astype(np.float32).ravel())
        made.update()
        made.pack()
        return made

    def environment(self) -> Any:
        """A float environment with a bright, colored patch."""
        height, width = 32, 64
        v, u = np.mgrid[0:height, 0:width] / np.array([height, width]).reshape(2, 1, 1)
        red = 0.2 + 0.8 * v + 12 * np.exp(-(((u - 0.3) / 0.08) ** 2 + ((v - 0.75) / 0.12) ** 2))
        pixels = np.stack([red, 0.3 + 0.5 * v + 0 * u, 0.6 - 0.3 * u, np.ones_like(u)], axis=-1)
        made = bpy.data.images.new("Sky", width, height, float_buffer=True)
        made.pixels.foreach_set(pixels.astype(np.float32).ravel())
        made.update()
        made.pack()
        return made
