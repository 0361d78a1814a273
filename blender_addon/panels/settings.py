# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of objects, materials, lights and worlds that this engine reads and that only panels of Cycles show.

Those panels ask in Python for the engine Cycles, so that ``shared`` cannot show them.
"""

from collections.abc import Iterable
from typing import Any

import bpy
from bpy.types import Context, UILayout

from ..translate.objects import UNSEEN
from .shared import ENGINE

RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")
WORLD_RAYS = {"camera": "Camera", "diffuse": "Diffuse", "glossy": "Glossy", "transmission": "Transmission",
              "scatter": "Volume Scatter"}  # fmt: skip


class _Settings:
    layout: UILayout
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: Context) -> bool:
        """For this engine, where there is something to set."""
        return context.engine == ENGINE and cls.applies(context)

    @classmethod
    def applies(cls, context: Context) -> bool:
        """True if there is something to set."""
        raise NotImplementedError

    def column(self, heading: str = "") -> UILayout:
        """A column of settings with their names at the left."""
        self.layout.use_property_split = True
        return self.layout.column(heading=heading)


def _draw(column: UILayout, owner: Any, names: Iterable[str]) -> None:
    """Draw the settings that this Blender has; ``owner``: None for settings of Cycles while it is disabled."""
    for name in names:
        if hasattr(owner, name):
            column.prop(owner, name)


class SPECTRAL_PT_ray_visibility(_Settings, bpy.types.Panel):
    """Rays that see the object, and whether it only catches shadows"""

    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"

    @classmethod
    def applies(cls, context: Context) -> bool:
        """For objects that rays can meet."""
        return context.object is not None and context.object.type not in UNSEEN

    def draw(self, context: Context) -> None:
        subject, column = context.object, self.column()
        for name in RAYS if subject.type != "LIGHT" else RAYS[:-1]:
            column.prop(subject, f"visible_{name}", text=name.replace("_", " ").title())
        column.separator()
        column.prop(subject, "is_shadow_catcher")


class SPECTRAL_PT_shadow_terminator(_Settings, bpy.types.Panel):
    """Where light at grazing angles starts from coarse smooth meshes"""

    bl_label = "Shadow Terminator"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_shading"

    @classmethod
    def applies(cls, context: Context) -> bool:
        """For a Blender without such a panel of its own."""
        return context.object is not None and not hasattr(bpy.types, "OBJECT_PT_shadow_terminator")

    def draw(self, context: Context) -> None:
        names = ("shadow_terminator_geometry_offset", "shadow_terminator_shading_offset", "shadow_terminator_offset")
        column = self.column()
        for owner in (context.object, getattr(context.object, "cycles", None)):
            _draw(column, owner, names)


class SPECTRAL_PT_object_motion_blur(_Settings, bpy.types.Panel):
    """Motion blur of this object"""

    bl_label = "Motion Blur"
    bl_context = "object"

    @classmethod
    def applies(cls, context: Context) -> bool:
        """If the scene is rendered with motion blur."""
        return context.scene.render.use_motion_blur and hasattr(context.object, "cycles")

    def draw(self, context: Context) -> None:
        _draw(self.column(), context.object.cycles, ("use_motion_blur", "use_deform_motion", "motion_steps"))


class SPECTRAL_PT_material_settings(_Settings, bpy.types.Panel):
    """Displacement, shadows and pass of the material"""

    bl_context = "material"

    @classmethod
    def applies(cls, context: Context) -> bool:
        """With a material."""
        return context.material is not None and not context.material.grease_pencil

    def draw(self, context: Context) -> None:
        _draw(self.column(), context.material, ("displacement_method", "use_transparent_shadow", "pass_index"))


class SPECTRAL_PT_light_settings(_Settings, bpy.types.Panel):
    """Shadows, bounces and spread of the lamp"""

    bl_context = "data"

    @classmethod
    def applies(cls, context: Context) -> bool:
        """With a lamp."""
        return context.light is not None

    def draw(self, context: Context) -> None:
        column, lamp = self.column(), context.light
        column.prop(lamp, "use_shadow", text="Cast Shadow")
        cycles = getattr(lamp, "cycles", None)
        _draw(column, cycles, ("max_bounces", "use_multiple_importance_sampling"))
        if lamp.type == "AREA":
            column.prop(lamp, "spread")
            if cycles is not None:
                column.prop(cycles, "is_portal", text="Portal")


class SPECTRAL_PT_world_settings(_Settings, bpy.types.Panel):
    """Light group, rays and bounces of the world"""

    bl_context = "world"

    @classmethod
    def applies(cls, context: Context) -> bool:
        """With a world."""
        return context.world is not None

    def draw(self, context: Context) -> None:
        world, column = context.world, self.column()
        groups = context.view_layer, "lightgroups"
        column.prop_search(world, "lightgroup", *groups, text="Light Group", results_are_suggestions=True)
        _draw(column, getattr(world, "cycles", None), ("max_bounces",))
        rays = getattr(world, "cycles_visibility", None)
        if rays is not None:
            column = self.column("Ray Visibility")
            for name, text in WORLD_RAYS.items():
                column.prop(rays, name, text=text)


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_PT_ray_visibility, SPECTRAL_PT_shadow_terminator, SPECTRAL_PT_object_motion_blur,
        SPECTRAL_PT_material_settings, SPECTRAL_PT_light_settings, SPECTRAL_PT_world_settings,
    )
)  # fmt: skip
