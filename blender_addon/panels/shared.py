# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of Blender, EEVEE and Cycles that are shown for this engine too: those of settings that it reads."""

from typing import Any

import bpy

from ..properties.render import ENGINE

BORROWED = (
    # EEVEE: what every camera, light, material and world has
    "DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture", "DATA_PT_EEVEE_light", "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_displacement", "EEVEE_MATERIAL_PT_surface", "EEVEE_MATERIAL_PT_volume", "EEVEE_WORLD_PT_mist",
    "EEVEE_WORLD_PT_surface", "EEVEE_WORLD_PT_volume", "MATERIAL_PT_preview", "NODE_DATA_PT_EEVEE_light",
    "OBJECT_PT_shadow_terminator", "RENDER_PT_eevee_film", "VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes",
    "VIEWLAYER_PT_layer_passes_aov", "VIEWLAYER_PT_layer_passes_cryptomatte", "VIEWLAYER_PT_layer_passes_lightgroups",
    "VIEWLAYER_PT_override",
    # Cycles, whose settings no other panel has; not those that ask for the engine Cycles themselves, see ``settings``
    "CYCLES_OBJECT_PT_lightgroup", "CYCLES_RENDER_PT_film", "CYCLES_RENDER_PT_film_pixel_filter",
    "CYCLES_RENDER_PT_film_transparency", "CYCLES_RENDER_PT_filter", "CYCLES_RENDER_PT_light_paths",
    "CYCLES_RENDER_PT_light_paths_caustics", "CYCLES_RENDER_PT_light_paths_clamping",
    "CYCLES_RENDER_PT_light_paths_max_bounces", "CYCLES_RENDER_PT_motion_blur", "CYCLES_RENDER_PT_motion_blur_curve",
    "CYCLES_RENDER_PT_override",
)  # fmt: skip

TWINS = {
    "DATA_PT_light": "DATA_PT_EEVEE_light", "NODE_DATA_PT_light": "NODE_DATA_PT_EEVEE_light",
    "RENDER_PT_eevee_film": "CYCLES_RENDER_PT_film", "VIEWLAYER_PT_filter": "CYCLES_RENDER_PT_filter",
}  # fmt: skip
"""Panels, each with the larger one that is shown in its place, if there is one."""

_with_own_set: list[Any] = []
"""Panels whose set of engines was that of their base class."""


def shared_panels() -> list[Any]:
    """Panels with a set of engines that also apply to this one."""
    panels = [panel for panel in bpy.types.Panel.__subclasses__() if hasattr(panel, "COMPAT_ENGINES")]
    names = {panel.__name__ for panel in panels}
    return [
        panel
        for panel in panels
        if (panel.__name__ in BORROWED or "BLENDER_RENDER" in panel.COMPAT_ENGINES)
        and TWINS.get(panel.__name__) not in names
    ]


@bpy.app.handlers.persistent
def show(*_: object) -> None:
    """Show the panels. Blender calls it after each file, too: Cycles may have been enabled after this extension."""
    for panel in bpy.types.Panel.__subclasses__():
        if panel.__name__ in TWINS:  # its twin may be new
            panel.COMPAT_ENGINES.discard(ENGINE)
    for panel in shared_panels():
        if "COMPAT_ENGINES" not in vars(panel):  # all panels of Cycles have one set
            panel.COMPAT_ENGINES = set(panel.COMPAT_ENGINES)
            _with_own_set.append(panel)
        panel.COMPAT_ENGINES.add(ENGINE)


def register() -> None:
    """Show the panels for this engine."""
    show()
    bpy.app.handlers.load_post.append(show)


def unregister() -> None:
    """Remove the engine from the panels."""
    bpy.app.handlers.load_post.remove(show)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard(ENGINE)
    while _with_own_set:
        del _with_own_set.pop().COMPAT_ENGINES
