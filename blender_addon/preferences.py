# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's preferences: the LLVM library of renders, if it is not the one in the extension."""

import os
from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy.types import Context

from spectral_core.llvm_library import OWN_VARIABLE

from .compat import path_options

CARRIED = Path(__file__).parent / "llvm"
"""LLVM in the Linux zip, beside this file."""
_given = os.environ.get(OWN_VARIABLE)


def choose_llvm(chosen: str) -> None:
    """Choose the LLVM library: that of the environment, else of the preferences, else of the extension."""
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
        description="Shared library of LLVM 17 or newer that renders are compiled with. Empty: the library in the "
        "extension, or the newest that is installed. Takes effect when the renderer is started next",
    )  # fmt: skip

    def draw(self, _context: Context) -> None:
        """Draw the path, and the library in use."""
        self.layout.prop(self, "llvm_library")
        named = os.environ.get(OWN_VARIABLE)
        self.layout.label(text=f"Used: {named}" if named else "Used: the newest that is installed, from version 17 on")


def register() -> None:
    """Add the preferences and choose the library."""
    bpy.utils.register_class(SPECTRAL_AP_preferences)
    addon = bpy.context.preferences.addons.get(__package__ or "")
    choose_llvm(addon.preferences.llvm_library if addon is not None and addon.preferences is not None else "")


def unregister() -> None:
    """Remove the preferences."""
    bpy.utils.unregister_class(SPECTRAL_AP_preferences)
