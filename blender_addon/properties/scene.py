# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.spectral``: palette, render settings, dial, board, sweep, spectral texture and recipe of a scene."""

import bpy
from bpy.props import PointerProperty

from .board import SpectralMixingBoard
from .dial import SpectralLightDial
from .palette.table import SpectralPalette
from .recipe import SpectralRecipe
from .render import SpectralRender
from .sweep import SpectralSweep
from .texture_design import SpectralTextureDesign
from .viewport import SpectralViewport


class SpectralScene(bpy.types.PropertyGroup):
    """All data of this extension on a scene."""

    palette: PointerProperty(type=SpectralPalette)
    render: PointerProperty(type=SpectralRender)
    dial: PointerProperty(type=SpectralLightDial)
    board: PointerProperty(type=SpectralMixingBoard)
    sweep: PointerProperty(type=SpectralSweep)
    viewport: PointerProperty(type=SpectralViewport)
    texture: PointerProperty(type=SpectralTextureDesign)
    recipe: PointerProperty(type=SpectralRecipe)


CLASSES = (SpectralScene,)


def register() -> None:
    """Add ``spectral`` to scenes."""
    bpy.utils.register_class(SpectralScene)
    bpy.types.Scene.spectral = PointerProperty(type=SpectralScene, name="Spectral")


def unregister() -> None:
    """Remove the attribute; stored data stay in the file."""
    del bpy.types.Scene.spectral
    bpy.utils.unregister_class(SpectralScene)
