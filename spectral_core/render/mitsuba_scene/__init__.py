# SPDX-License-Identifier: GPL-3.0-or-later
"""A ``Scene`` as Mitsuba objects."""

from spectral_core.render.mitsuba_scene.assemble import LoadedScene, load_scene

__all__ = ["LoadedScene", "load_scene"]
