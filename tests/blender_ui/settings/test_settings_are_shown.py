# SPDX-License-Identifier: GPL-3.0-or-later
"""Each setting with a label is in a panel: all panels are drawn, once for each value of each switch and list."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

import blender_addon.properties as declared  # noqa: E402
from blender_addon.panels.viewport import draw_header  # noqa: E402
from blender_addon.translate.spectra.stored import store_spectrum  # noqa: E402
from spectral_core.spectra.catalogue import illuminant  # noqa: E402

NOT_IN_A_PANEL = {
    "SpectralBoardOrder.lower": "chosen by an operator",
    "SpectralBoardOrder.upper": "chosen by an operator",
    "SpectralDye.amount": "a result, drawn as text",
    "SpectralMixingBoard.active": "the selected row",
    "SpectralPalette.active_column": "the selected cell, chosen by an operator",
    "SpectralPalette.active_row": "the selected cell, chosen by an operator",
    "SpectralPaletteCell.delta_e": "a result, drawn as text",
    "SpectralPaletteLamp.amount": "a result, drawn as text",
    "SpectralPaletteLight.white_xyz": "set by Look White, and by a palette's file",
    "SpectralPlanChoice.value": "chosen by an operator",
    "SpectralSample.value": "drawn as a curve",
    "SpectralSample.wavelength_nm": "drawn as a curve",
    "SpectralSpectrum.dispersion": "its settings are drawn",
    "SpectralSpectrum.dyes": "each one is drawn",
    "SpectralSpectrum.interpolation": "of the source of the spectrum",
    "SpectralSpectrum.message": "drawn as text",
    "SpectralSpectrum.origin": "drawn as text",
    "SpectralSpectrum.samples": "drawn as a curve",
    "SpectralSpectrum.spectrum_name": "drawn as text",
    "SpectralSweep.active": "the selected row",
    "SpectralViewport.is_split": "switched by an operator",
}
"""Labeled properties that no panel shows, each with its reason."""


class Drawn:
    """A layout that keeps the properties that are drawn, as ``Struct.property``."""

    def __init__(self, found: set[str], context: Any) -> None:
        self.found, self.context = found, context

    def prop(self, owner: Any, name: str, *_arguments: Any, **_options: Any) -> None:
        assert name in owner.bl_rna.properties, f"{owner} has no {name}"
        self.found.add(f"{owner.bl_rna.identifier}.{name}")

    prop_search = prop_menu_enum = prop_enum = template_curve_mapping = template_color_ramp = template_ID = prop

    def template_list(self, kind: str, _id: str, owner: Any, items: str, active_of: Any, active: str, **_: Any) -> None:
        self.prop(active_of, active)
        lists = getattr(bpy.types, kind, None)
        if lists is None or kind == "UI_UL_list":
            return
        for number, each in enumerate(getattr(owner, items)):
            given = (self.context, self, owner, each, 0, active_of, active, number)
            wanted = len(inspect.signature(lists.draw_item).parameters) - 1
            lists.draw_item(Shown(lists, self), *given[:wanted])

    def __getattr__(self, name: str) -> Any:
        """Every other part of a layout: rows and columns that draw here as well, and the settings of a button."""
        if name.startswith("operator"):
            return lambda *_arguments, **_options: SimpleNamespace()
        return lambda *_arguments, **_options: self

    def __bool__(self) -> bool:
        return False


class Context:
    """Blender's context with some members replaced."""

    def __init__(self, **members: Any) -> None:
        vars(self).update(members)

    def __getattr__(self, name: str) -> Any:
        return getattr(bpy.context, name)


class Shown:
    """In place of an instance of a panel: its class's functions, and a layout."""

    def __init__(self, kind: type, layout: Drawn) -> None:
        self.kind, self.layout = kind, layout

    def __getattr__(self, name: str) -> Any:
        value = getattr(self.kind, name)
        bound = inspect.isfunction(inspect.getattr_static(self.kind, name))
        return value.__get__(self) if bound else value


def labeled() -> set[str]:
    """All properties of the extension that have a label, as ``Struct.property``."""
    modules = [module for name, module in sys.modules.items() if name.startswith(declared.__name__ + ".")]
    return {
        f"{kind.__name__}.{name}"
        for module in modules
        for kind in vars(module).values()
        if inspect.isclass(kind) and kind.__module__ == module.__name__
        for name, made in vars(kind).get("__annotations__", {}).items()
        if "name" in getattr(made, "keywords", ())
    }


def panels_of_ours(kind: type = bpy.types.Panel) -> Iterator[type]:
    """The extension's classes of panels."""
    for each in kind.__subclasses__():
        yield from panels_of_ours(each)
        if each.__module__.startswith("blender_addon.panels."):
            yield each


def draw_all(context: Context, found: set[str]) -> None:
    """Draw every panel of the extension whose ``poll`` holds, and the header of 3D views."""
    draw_header(SimpleNamespace(layout=Drawn(found, context)), context)
    for kind in panels_of_ours():
        if not hasattr(kind, "poll") or kind.poll(context):
            shown = Shown(kind, Drawn(found, context))
            for draw in ("draw_header", "draw"):
                if inspect.isfunction(getattr(kind, draw, None)):
                    getattr(kind, draw)(shown, context)


def switched(owners: list[Any]) -> Iterator[None]:
    """Each switch on and off, each list at each of its values, one after another; all else as it was."""
    for owner in owners:
        for declaration in owner.bl_rna.properties:
            name = declaration.identifier
            if declaration.type == "BOOLEAN" and not declaration.is_readonly and not declaration.is_array:
                values: list[Any] = [True, False]
            elif declaration.type == "ENUM" and not declaration.is_enum_flag:
                values = [item.identifier for item in declaration.enum_items]
            else:
                continue
            kept = getattr(owner, name)
            for value in values:
                setattr(owner, name, value)
                yield
            setattr(owner, name, kept)


@pytest.fixture
def filled(blender):
    """A scene in which every group of properties has a member; all of them, and the context of the panels."""
    scene = blender.context.scene
    scene.render.engine = "SPECTRAL"
    ours = scene.spectral
    ours.palette.live = False
    bpy.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    light, material = ours.palette.lights[0], ours.palette.materials[0]
    light.primaries.add(), light.variants.add(), material.dyes.add()
    cell = material.cells[0]
    cell.mode, cell.use_box = "FREE", True
    answer = ours.palette.possible
    answer.words, answer.material_uid, answer.light_uid = "impossible", material.uid, light.uid
    ours.board.feedback_host, ours.recipe.kind, ours.recipe.wanted = "127.0.0.1", "PAINTS", "NAMED"
    ours.texture.texture_file = "texture.npz"
    ours.texture.wanted_colors.add().outcome = "reached"
    ours.dial.bulbs.add().name = "key"
    ours.board.bindings.add().name = 'bpy.data.scenes["Scene"].frame_start'
    turned = bpy.data.objects.new("turned", None)
    for number, path in enumerate(("render.pixel_aspect_x", "render.use_border")):
        bpy.ops.spectral.sweep_add(target=f'bpy.data.scenes["Scene"].{path}')
        assert len(ours.sweep.parameters) == number + 1
    bpy.ops.spectral.sweep_add(target=f'bpy.data.objects["{turned.name}"].rotation_euler[0]')
    volume = bpy.data.volumes.new("volume")
    volume.spectral.enabled = True
    opacity = volume.spectral.materials.add()
    painted, lamp, world = bpy.data.materials.new("painted"), bpy.data.lights.new("lamp", "POINT"), scene.world
    painted.spectral.dyes.add()
    store_spectrum(lamp.spectral, illuminant("D65"))
    owners = [
        ours.palette, light, material, cell, ours.render, ours.dial, ours.board, ours.sweep,
        ours.viewport, ours.viewport.look, ours.texture, ours.recipe, volume.spectral, opacity, painted.spectral,
        painted.spectral.dispersion, lamp.spectral,
    ]  # fmt: skip
    view = SimpleNamespace(type="VIEW_3D", shading=SimpleNamespace(type="RENDERED"))
    context = Context(
        engine="SPECTRAL", volume=volume, material=painted, light=lamp, world=world, space_data=view, object=None,
        active_node=None, region=None, preferences=None,
    )  # fmt: skip
    return owners, context


def test_each_setting_with_a_label_is_in_a_panel(filled):
    owners, context = filled
    found: set[str] = set()
    draw_all(context, found)
    for _ in switched(owners):
        draw_all(context, found)
    missing = labeled() - found - set(NOT_IN_A_PANEL)
    assert not missing, "\n".join(sorted(missing))
    assert set(NOT_IN_A_PANEL) <= labeled() - found
