# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.spectral``: the palette, the render settings, the light dial, the mixing board and the sweep of a scene."""

import bpy
from bpy.props import PointerProperty

from .board import SpectralMixingBoard
from .dial import SpectralLightDial
from .palette import SpectralPalette
from .render import SpectralRender
from .sweep import SpectralSweep


class SpectralScene(bpy.types.PropertyGroup):
    """Everything that this extension stores on a scene."""

    palette: PointerProperty(type=SpectralPalette)
    render: PointerProperty(type=SpectralRender)
    dial: PointerProperty(type=SpectralLightDial)
    board: PointerProperty(type=SpectralMixingBoard)
    sweep: PointerProperty(type=SpectralSweep)


CLASSES = (SpectralScene,)


def register() -> None:
    """Add ``spectral`` to scenes."""
    bpy.utils.register_class(SpectralScene)
    bpy.types.Scene.spectral = PointerProperty(type=SpectralScene, name="Spectral")


def unregister() -> None:
    """Remove the attribute; stored data stay in the file."""
    del bpy.types.Scene.spectral
    bpy.utils.unregister_class(SpectralScene)
