# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's preferences: which LLVM renders, where the one that the extension carries is not wanted."""

import os
from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy.types import Context

from spectral_core.llvm_library import OWN_VARIABLE

from .compat import path_options

CARRIED = Path(__file__).parent / "llvm"
"""Beside this file in the Linux zip."""
_given = os.environ.get(OWN_VARIABLE)


def choose_llvm(chosen: str) -> None:
    """Let renders use a library: the environment's, else the chosen one, else the one that the extension carries."""
    wanted = _given or bpy.path.abspath(chosen) or (str(CARRIED) if CARRIED.is_dir() else "")
    if wanted:
        os.environ[OWN_VARIABLE] = wanted
    else:
        os.environ.pop(OWN_VARIABLE, None)


class SPECTRAL_AP_preferences(bpy.types.AddonPreferences):
    """Shown under Preferences, Add-ons."""

    bl_idname = __package__ or "blender_addon"

    llvm_library: StringProperty(
        name="LLVM Library", subtype="FILE_PATH", options=path_options(),
        update=lambda self, _context: choose_llvm(self.llvm_library),
        description="Shared library of LLVM 17 or newer that renders are compiled with. Empty: the one that the "
        "extension carries, or the newest that is installed. Used by renders that start after Blender does",
    )  # fmt: skip

    def draw(self, _context: Context) -> None:
        """The path, and what is used now."""
        self.layout.prop(self, "llvm_library")
        named = os.environ.get(OWN_VARIABLE)
        self.layout.label(text=f"Used: {named}" if named else "Used: the newest that is installed, from version 17 on")


def register() -> None:
    """Add the preferences and choose the library."""
    bpy.utils.register_class(SPECTRAL_AP_preferences)
    addon = bpy.context.preferences.addons.get(__package__ or "")
    choose_llvm(addon.preferences.llvm_library if addon is not None and addon.preferences is not None else "")


def unregister() -> None:
    """Take the preferences away."""
    bpy.utils.unregister_class(SPECTRAL_AP_preferences)
