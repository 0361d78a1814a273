# SPDX-License-Identifier: GPL-3.0-or-later
"""Every property that the extension declares is an input that a test changes, or is listed here with a reason."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon import preferences
from blender_addon.properties.palette.table import PALETTE_FIELDS
from blender_addon.properties.render import RENDER_FIELDS
from blender_addon.properties.texture import SpectralTextureNode
from blender_addon.properties.volume import VOLUME_FIELDS
from spectral_core.llvm_library import OWN_VARIABLE
from tests.blender import own_cases
from tests.blender_ui.settings.own_walks import WALKS, filled
from tests.settings_walk import because, ignored_settings, other_rna, read_rna

TESTS = Path(__file__).parents[2]


@pytest.mark.parametrize("name", WALKS)
def test_every_own_setting_changes_what_reads_it(blender: Any, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    scene, walk = blender.context.scene, WALKS[name]
    owner = walk.owner(filled(scene))
    for setting, value in walk.first.items():
        setattr(owner, setting, value)

    def other(setting: str) -> Any:
        if setting.endswith("_uid"):  # of the other row or column
            table = scene.spectral.palette
            entries = table.lights if setting == "light_uid" else table.materials
            return next(each.uid for each in entries if each.uid != getattr(owner, setting))
        return walk.others.get(setting, other_rna(owner, setting))

    found = ignored_settings(
        walk.names.split(), lambda setting: read_rna(owner, setting), lambda setting, v: setattr(owner, setting, v),
        other, lambda: walk.seen(scene, monkeypatch),
    )  # fmt: skip
    assert found == {}


RESULT = "a result, which the extension writes"
NUMBER = "a lasting number of a row, which the extension counts"
SELECTED = "the selected row of a list"
CONTENT = "a group or list, whose entries are listed here"
KNOWN_NAME = "the name of chosen data, by which deleted data are told"


NO_INPUT = {
    **because(RESULT, """
        SpectralAlternative.apart SpectralAlternative.asked SpectralAlternative.spectra
        SpectralAlternative.cells SpectralAlternative.colors
        SpectralAlternative.lamps SpectralCostPoint.* SpectralPlanLine.* SpectralRender.cost
        SpectralRender.cost_summary SpectralRender.plan SpectralRender.plan_accepted
        SpectralRender.own_settings
        SpectralPaletteCell.actual_linear SpectralPaletteCell.wanted_linear SpectralPaletteCell.actual_display
        SpectralPaletteCell.wanted_display SpectralPaletteCell.has_result SpectralPaletteCell.delta_e
        SpectralPaletteCell.actual SpectralPaletteCell.wanted SpectralPaletteConflict.*
        SpectralPaletteLamp.amount SpectralPaletteLight.result SpectralPaletteMaterial.result
        SpectralDye.amount SpectralPossible.* SpectralPalette.picture SpectralPalette.applied_exposure
        SpectralPalette.is_stale SpectralPalette.is_alternative SpectralPalette.is_unfinished
        SpectralPalette.status SpectralPalette.remedy SpectralPalette.message
        SpectralPalette.notes SpectralPalette.conflicts SpectralPalette.possible SpectralPalette.alternatives
        SpectralPalette.milliseconds SpectralPalette.light_scale SpectralPalette.worst_delta_e
        SpectralSpectrum.message SpectralTextureNode.message SpectralViewport.preview_message
        SpectralVolume.facts SpectralDialMember.*
        SpectralDialBulb.members SpectralDialBulb.lit SpectralDialBulb.is_dark SpectralLightDial.named_by_object
        SpectralDialBulb.color SpectralLightDial.scene_hash SpectralLightDial.own_ending SpectralLightDial.facts
        SpectralLightDial.picture
        SpectralLightDial.keeps_spectra SpectralLightDial.recorded_parts SpectralLightDial.recorded_groups
        SpectralLightDial.changes SpectralLightDial.message SpectralMixingBoard.status
        SpectralMixingBoard.simultaneity SpectralSweep.point SpectralSweep.status SpectralSweep.done
        SpectralSweep.total SpectralSweep.is_under_way
        SpectralTextureDesign.is_under_way SpectralTextureWantedColor.outcome SpectralTextureWantedColor.reached
        SpectralTextureDesign.status SpectralTextureDesign.failed SpectralTextureDesign.progress
        SpectralTextureDesign.texture_file SpectralTextureDesign.designed_as
        SpectralTextureDesign.report SpectralTextureDesign.lost_1
        SpectralTextureDesign.lost_2 SpectralRecipe.text SpectralRecipe.met SpectralRecipe.spectrum
        SpectralRecipe.found_kind"""),
    **because(NUMBER, "SpectralPalette.next_uid SpectralPaletteLight.uid SpectralPaletteMaterial.uid "
               "SpectralVolume.next_uid SpectralVolumeMaterial.uid"),
    **because(SELECTED, "SpectralPalette.active_row SpectralPalette.active_column SpectralLightDial.active "
               "SpectralMixingBoard.active SpectralSweep.active SpectralVolume.active"),
    **because(KNOWN_NAME, "SpectralPaletteLight.light_name SpectralPaletteLight.world_name "
               "SpectralPaletteLight.known_as SpectralPaletteMaterial.known_as SpectralPaletteMaterial.material_name"),
    **because(CONTENT, """
        SpectralScene.* SpectralPalette.lights SpectralPalette.materials SpectralPaletteMaterial.cells
        SpectralPaletteMaterial.dyes SpectralPaletteMaterial.spectral SpectralPaletteLight.spectral
        SpectralPaletteLight.primaries SpectralPaletteLight.variants SpectralPaletteLamp.spectral
        SpectralPaletteCell.others SpectralSpectrum.samples SpectralSpectrum.dyes SpectralSpectrum.dispersion
        SpectralLightDial.bulbs
        SpectralMixingBoard.bindings SpectralMixingBoard.orders SpectralSweep.parameters SpectralRender.overrides
        SpectralViewport.look SpectralViewport.other SpectralVolume.materials SpectralVolumeMaterial.spectral
        SpectralTextureDesign.wanted_colors SpectralTextureLight.spectral"""),
    "SpectralVolume.source": "names the imported file; the data are in the Volume",
    "SpectralTextureDesign.folder": "the place of the results",
    "SpectralTextureDesign.lamp_1": "the lamp that gets a result",
    "SpectralTextureDesign.lamp_2": "the lamp that gets a result",
}  # fmt: skip
"""Properties that are no input of a translation, ``*``: all of a type."""
IN_A_TEST_OF_ITS_OWN = {
    "blender_ui/settings/test_declared_settings.py": [
        *(f"SpectralPalette.{name}" for name in PALETTE_FIELDS), *(f"SpectralRender.{name}" for name in RENDER_FIELDS),
        *(f"SpectralVolume.{name}" for name in VOLUME_FIELDS),
    ],
    "blender_ui/settings/test_panel_settings_are_read.py": [
        "SpectralTextureDesign", "SpectralTextureWantedColor", "SpectralRecipe", "SpectralSweep",
        "SpectralSweepParameter",
    ],
    "blender_relight/board/test_board_settings.py": [
        "SpectralMixingBoard", "SpectralBoardBinding", "SpectralBoardOrder",
    ],
}  # fmt: skip
"""Settings that another file walks: single ones, or all that a type has beside ``NO_INPUT``."""


BY_NAME = {
    "blender/surfaces/test_dispersion.py": "SpectralDispersion.source SpectralDispersion.abbe_number "
                                  "SpectralDispersion.material",
    "blender_ui/solving/test_palette_live.py": "SpectralPalette.live",
    "blender_ui/solving/test_palette_possible.py": "SpectralPalette.possible_follows",
    "blender_ui/solving/test_palette_solving.py": "SpectralPalette.show_curves",
    "blender_ui/palette/test_palette_apply.py": "SpectralPalette.level_to SpectralPaletteMaterial.material "
                                        "SpectralPaletteLight.light",
    "blender_ui/settings/test_settings_behind_buttons.py": "SpectralPaletteLight.world",
    "blender_ui/test_files.py": "SpectralSpectrum.filepath SpectralSpectrum.file_entry",
    "blender_ui/jobs/test_dial_by_hand.py": "SpectralLightDial.show",
    "blender_relight/dial/test_dial_changes.py": "SpectralLightDial.over_camera",
    "blender_relight/dial/test_light_dial.py": "SpectralDialBulb.lamp",
    "blender_ui/settings/test_own_settings_are_read.py": "SPECTRAL_AP_preferences.llvm_library",
    "blender_viewport/contents/test_design_in_view.py": "SpectralPalette.in_viewport SpectralPalette.apply_colors",
    "blender_viewport/edits/test_viewport_edits.py": "SpectralViewport.is_paused SpectralViewport.samples",
    "blender_viewport/test_denoised_view.py": "SpectralViewport.denoise",
    "blender_viewport/test_look.py": "SpectralViewport.is_split SpectralViewport.divider SpectralViewport.preview_lamp",
    "blender_volume/test_volume_objects.py": "SpectralVolume.enabled SpectralVolume.grid SpectralVolume.curves",
}  # fmt: skip
"""Settings whose effect a test states by itself: the file names each of them."""


def own_types() -> dict[str, set[str]]:
    """Names of the properties of each type that the extension declares: groups, nodes and preferences."""
    kinds = [*bpy.types.PropertyGroup.__subclasses__(), SpectralTextureNode, preferences.SPECTRAL_AP_preferences]
    own = [kind for kind in kinds if kind.__module__.startswith("blender_addon.")]
    return {kind.__name__: set(vars(kind).get("__annotations__", {})) for kind in own}


def named_in_walks() -> set[str]:
    """The settings that are walked by a case, as ``Type.setting``."""
    cases = [*WALKS.values(), *own_cases.CASES.values()]
    return {f"{case.kind}.{name}" for case in cases for name in case.names.split()}


def test_every_property_of_the_extension_is_an_input_that_is_tested_or_has_a_reason(blender: Any) -> None:
    types = own_types()
    assert len(types) >= 30
    elsewhere = {name for names in IN_A_TEST_OF_ITS_OWN.values() for name in names}
    known = (
        named_in_walks() | elsewhere | set(NO_INPUT) | {name for names in BY_NAME.values() for name in names.split()}
    )
    every = {f"{kind}.{name}" for kind, names in types.items() for name in names}
    missing = {name for name in every if not {name, kind := name.partition(".")[0], f"{kind}.*"} & known}
    assert missing == set()
    stale = {name for name in known if "." in name and not name.endswith((".*", ".name")) and name not in every}
    assert stale == set()


@pytest.mark.parametrize("file", BY_NAME)
def test_a_file_that_states_the_effect_of_a_setting_names_it(file: str) -> None:
    text = (TESTS / file).read_text("utf-8")
    for name in BY_NAME[file].split():
        assert re.search(rf"\b{name.partition('.')[2]}\b", text), name


def test_the_llvm_library_of_the_preferences_is_used_unless_the_environment_names_one(
    blender: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``llvm_library`` calls this when it changes."""
    monkeypatch.setenv(OWN_VARIABLE, "")
    monkeypatch.setattr(preferences, "_given", None)
    preferences.choose_llvm("/opt/libLLVM.so")
    assert os.environ[OWN_VARIABLE] == "/opt/libLLVM.so"
    monkeypatch.setattr(preferences, "_given", "/usr/lib/libLLVM-19.so")
    preferences.choose_llvm("/opt/libLLVM.so")
    assert os.environ[OWN_VARIABLE] == "/usr/lib/libLLVM-19.so"
