# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the extension that no render reads, each with what it changes: the palette's problem, the dial's weights.

Those that a render reads are in ``tests/blender/own_cases.py``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from blender_addon.editing.dial.live import shares_of, transport_path, weights_of
from blender_addon.editing.dial.members import group_count
from blender_addon.editing.palette import alternatives
from blender_addon.translate.dial import storage_name, storage_of
from blender_addon.translate.palette.load import store_problem
from blender_addon.translate.palette.paint import solver_of
from blender_addon.translate.palette.problem import palette_problem
from blender_addon.translate.spectra.stored import spectrum_of, store_spectrum
from blender_addon.translate.volume_looks.curves import add_material
from blender_addon.translate.volume_looks.transfer import stated_transfer
from spectral_core.palette import presets
from spectral_core.palette.paint import fluorescent_design, tints
from spectral_core.spectra.catalogue import illuminant, reflectance


@dataclass(frozen=True)
class Walk:
    """Settings ``names`` of a type of properties.

    ``owner``: the struct, from the extension's settings of a scene. ``seen``: what must change, from the scene and a
    monkeypatch. ``first``: values that must be set before others count. ``others``: values to change to, where not any
    other will do.
    """

    kind: str
    owner: Callable[[Any], Any]
    names: str
    seen: Callable[[Any, pytest.MonkeyPatch], Any]
    first: dict[str, Any] = field(default_factory=dict)
    others: dict[str, Any] = field(default_factory=dict)


def filled(scene: Any) -> Any:
    """The extension's settings of a scene with a table of two materials and lights, a dial of two bulbs, and lamps."""
    import bpy

    ours = scene.spectral
    ours.palette.live = False
    store_problem(ours.palette, presets.metamer_pair())
    for number, lamp in enumerate(("HP1", "FL2")):
        data = bpy.data.lights.new(lamp, "POINT")
        thing = bpy.data.objects.new(lamp, data)
        scene.collection.objects.link(thing)
        bulb = ours.dial.bulbs.add()
        bulb.name, bulb.place = lamp, (number - 0.5, 0.2)
    return ours


def problem(scene: Any, _: pytest.MonkeyPatch) -> Any:
    """What the palette's solver gets."""
    return palette_problem(scene.spectral.palette)


def tinted(scene: Any, patch: pytest.MonkeyPatch) -> Any:
    """The criterion of tints that reaches the core, None without."""
    asked: list[Any] = []
    patch.setattr(tints, "solve_with_tints", lambda _, criterion, **_warm: asked.append(criterion))
    if scene.spectral.palette.use_tints:
        solver_of(scene.spectral.palette).solve(palette_problem(scene.spectral.palette), None)
    return [each.weight for each in asked]


def dyed(scene: Any, patch: pytest.MonkeyPatch) -> Any:
    """The dyes that reach the core."""
    asked: list[Any] = []

    def solve(_: Any, dyes: Any, **__: Any) -> None:
        asked.extend((dye.excitation, dye.emission) for dye in dyes[0])
        raise InterruptedError

    patch.setattr(fluorescent_design, "solve_fluorescent", solve)
    with pytest.raises(InterruptedError):
        solver_of(scene.spectral.palette).solve(palette_problem(scene.spectral.palette), None)
    return asked


def more_answers(scene: Any, patch: pytest.MonkeyPatch) -> Any:
    """The search for alternatives."""
    asked: list[Any] = []
    patch.setattr(alternatives, "alternatives", lambda _, **options: asked.append(options) or [])
    alternatives.search(scene)()
    return asked


def first_cell(ours: Any) -> Any:
    """The cell of the first material under the first light."""
    return ours.palette.materials[0].cells[0]


def reference(ours: Any) -> Any:
    """The cell to which the first cell refers."""
    cell = first_cell(ours)
    cell.mode = "SAME"
    cell.others.clear()
    entry = cell.others.add()
    entry.material_uid, entry.light_uid = ours.palette.materials[1].uid, ours.palette.lights[1].uid
    return entry


def given_material(ours: Any) -> Any:
    """The first material, with a measured spectrum."""
    material = ours.palette.materials[0]
    store_spectrum(material.spectral, reflectance("red"))
    return material


def mixed_light(ours: Any) -> Any:
    """The first light, to be designed, with a list of lamps."""
    light = ours.palette.lights[0]
    light.design = "DESIGNED"
    for name in ("HP1", "FL11"):
        store_spectrum(light.primaries.add().spectral, illuminant(name))
    return light


def spectrum(scene: Any, _: pytest.MonkeyPatch) -> Any:
    """The spectrum of the second light of the table."""
    return spectrum_of(scene.spectral.palette.lights[1])


def weights(scene: Any, _: pytest.MonkeyPatch) -> Any:
    """Shares and factors of the bulbs, and the groups, storage and file of a recording."""
    dial, layer = scene.spectral.dial, scene.view_layers[0]
    return (
        np.round(shares_of(dial), 5), np.round(weights_of(dial), 5), group_count(layer, dial.one_per_light),
        storage_name(storage_of(dial)), transport_path(dial).name,
    )  # fmt: skip


def volume_material(_: Any) -> Any:
    """A material of a transfer function."""
    import bpy

    return add_material(bpy.data.volumes.new("volume"), "bone")


def transfer(_scene: Any, _patch: pytest.MonkeyPatch) -> Any:
    """The transfer function that the core gets."""
    import bpy

    return stated_transfer(bpy.data.volumes["volume"]).transfer


def _palette(ours: Any) -> Any:
    return ours.palette


def _with_dye(ours: Any) -> Any:
    ours.palette.grid_start = 340.0
    return ours.palette.materials[0].dyes.add()


def _solved(ours: Any) -> Any:
    material = ours.palette.materials[1]
    for each in ours.palette.materials:
        store_spectrum(each.result, reflectance("green"))
    return material


WALKS = {
    "color of a cell": Walk("SpectralPaletteCell", first_cell, "mode target weight exact", problem,
                            {"mode": "FIXED"}, {"mode": "BLACK"}),
    "range of a cell": Walk("SpectralPaletteCell", first_cell, "use_box box_low box_high", problem,
                            {"mode": "FREE", "use_box": True}),
    "cell that another refers to": Walk("SpectralPaletteReference", reference, "light_uid", problem),
    "material that a cell refers to": Walk("SpectralPaletteReference", reference, "material_uid", problem),
    "light": Walk("SpectralPaletteLight", lambda ours: ours.palette.lights[0], "name design intensity", problem),
    "light to design": Walk("SpectralPaletteLight", mixed_light, "keeps_luminance looks_white use_primaries", problem),
    "white of a light": Walk("SpectralPaletteLight", mixed_light, "white_xyz", problem, {"looks_white": True}),
    "material": Walk("SpectralPaletteMaterial", given_material, "name design", problem),
    "level of the table": Walk("SpectralPalette", _palette, "brightness", problem),
    "tints": Walk("SpectralPalette", _palette, "use_tints tint_weight", tinted, {"use_tints": True}),
    "dye": Walk("SpectralDye", _with_dye, "excitation_nm emission_nm", dyed),
    "count of alternatives": Walk("SpectralPalette", _palette, "alternative_count", more_answers),
    "locked material": Walk("SpectralPaletteMaterial", _solved, "locked", more_answers),
    "spectrum of a light": Walk("SpectralSpectrum", lambda ours: ours.palette.lights[1].spectral,
                                "source catalogue_name", spectrum,
                                {"source": "CATALOGUE", "catalogue_name": "FL2"},
                                {"catalogue_name": "HP1", "source": "NONE"}),
    "kind of a spectrum": Walk("SpectralSpectrum", lambda ours: given_material(ours).spectral, "kind",
                               lambda scene, _: spectrum_of(scene.spectral.palette.materials[0]),
                               others={"kind": "ILLUMINANT"}),
    "dial": Walk("SpectralLightDial", lambda ours: ours.dial, "selector intensity storage one_per_light filepath",
                 weights),
    "material of a volume": Walk("SpectralVolumeMaterial", volume_material, "name color density emission lit "
                                 "use_gradient", transfer),
    "edges of a volume": Walk("SpectralVolumeMaterial", volume_material, "gradient", transfer, {"use_gradient": True}),
    "bulb": Walk("SpectralDialBulb", lambda ours: ours.dial.bulbs[0], "place is_on", weights),
}  # fmt: skip
