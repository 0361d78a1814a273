# SPDX-License-Identifier: GPL-3.0-or-later
"""Each setting is declared once: the core, documents, panels and translations agree with the declaration.

Every translation is checked twice. With all settings it must keep each one; with one setting removed from the
translation, the same check must fail. A forgotten setting is therefore detected.
"""

from __future__ import annotations

import ast
import contextlib
from dataclasses import fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import get_args, get_type_hints

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon import panels
from blender_addon.properties.palette.cell import ASKED, VISIBLE_DELTA_E
from blender_addon.properties.palette.table import PALETTE_FIELDS, WHITE_XYZ
from blender_addon.properties.render import RENDER_FIELDS
from blender_addon.properties.volume import VOLUME_FIELDS
from blender_addon.translate import settings as render_settings
from blender_addon.translate.palette import settings as palette_settings
from blender_addon.translate.palette.load import store_problem
from blender_addon.translate.palette.problem import palette_problem
from blender_addon.translate.volume_looks import look as volume_look
from spectral_core.documents.schema import Schema
from spectral_core.palette import PaletteProblem, presets
from spectral_core.palette.files import document as documents
from spectral_core.palette.solution import VISIBLE_DELTA_E as DECLARED_VISIBLE_DELTA_E
from spectral_core.render.volumes import LIGHTING
from spectral_core.scene import RenderSettings, VolumeObject
from spectral_core.volume.march.rules import RULES

OTHER_PALETTE = {
    "scale_lights": True, "smoothness": 0.25, "operator": "thesis", "match": "perceptual", "rounds": 3,
    "observers": {"cie_1931_2deg", "cie_2015_2deg"}, "robustness": "worst_case", "robust_weight": 2.5,
    "allow_negative": True, "grid_start": 390.0, "grid_stop": 720.0, "grid_samples": 43,
}  # fmt: skip
OTHER_RENDER = {
    "samples": 7, "seed": 3, "transport": "SPECTRAL", "tolerance": 2.5, "target_error": 0.5, "time_budget": 7.0,
    "denoise": True,
}  # fmt: skip
GOALS = {"target_error": "ERROR", "time_budget": "TIME"}
OTHER_VOLUME = {"rule": "uniform", "quality_db": 33.0, "lighting": "shadows"}
TABLE = {"lights", "reflectances", "cells"}
NOT_IN_THE_TABLE = {"subspace": "refused by name when a palette is loaded"}
NOT_IN_RENDER = {
    "max_bounces": "a decision of the plan, among the overrides",
    "variant": "chosen by what is installed",
    "overrides": "a list of its own in the panel",
    "white": "the scene's own, no setting",
    "display_exposure": "the exposures of Color Management and of Look Under",
    "passes": "Blender's own panel, View Layer ▸ Passes",
    "light_paths": "Blender's own panel, Light Paths",
    "scene_bounces": "Blender's own panel, Light Paths",
}


def without(declared, name):
    """The declaration without one setting."""
    return MappingProxyType({key: field for key, field in declared.items() if key != name})


def same(mine, theirs) -> bool:
    if hasattr(mine, "wavelengths_nm"):
        return mine.size == theirs.size and np.allclose(mine.wavelengths_nm, theirs.wavelengths_nm)
    return mine == pytest.approx(theirs) if isinstance(mine, float) else mine == theirs


@pytest.fixture
def palette(blender):
    palette = blender.context.scene.spectral.palette
    palette.live = False
    store_problem(palette, presets.metamer_pair())
    return palette


def kept_in_the_core(palette, name) -> bool:
    """True if another value of a setting changes the core's problem in the setting's own attributes alone."""
    field = PALETTE_FIELDS[name]
    try:
        before = palette_problem(palette)
        setattr(palette, name, OTHER_PALETTE[name])
        after = palette_problem(palette)
    except KeyError:
        return False
    changed = {each.name for each in fields(PaletteProblem) if each.name not in TABLE
               and not same(getattr(before, each.name), getattr(after, each.name))}  # fmt: skip
    return changed == set(field.core)


def kept_in_the_table(palette, name) -> bool:
    """True if the table keeps another value of a setting."""
    setattr(palette, name, OTHER_PALETTE[name])
    wanted = palette_problem(palette)
    palette.property_unset(name)
    store_problem(palette, wanted)
    got = palette_problem(palette)
    return all(same(getattr(got, core), getattr(wanted, core)) for core in PALETTE_FIELDS[name].core)


def kept_in_a_document(palette, name) -> bool:
    """True if a document keeps another value of a setting."""
    setattr(palette, name, OTHER_PALETTE[name])
    wanted = palette_problem(palette)
    try:
        got = documents.problem_of(documents.document_of(wanted), Path())
    except Exception:
        return False
    return all(same(getattr(got, core), getattr(wanted, core)) for core in PALETTE_FIELDS[name].core)


def kept_by_the_session(palette, name) -> bool:
    """True if a live edit of a setting is solved with the new value."""
    from blender_addon.editing.palette import session

    palette.allow_negative = False
    session.forget_sessions()
    session.live_solution(1, palette_problem(palette))
    setattr(palette, name, OTHER_PALETTE[name])
    asked = palette_problem(palette)
    answered = session.live_solution(1, asked).problem
    session.forget_sessions()
    return all(same(getattr(answered, core), getattr(asked, core)) for core in PALETTE_FIELDS[name].core)


def test_every_setting_of_the_core_is_declared():
    named = {core for field in PALETTE_FIELDS.values() for core in field.core}
    assert named == {each.name for each in fields(PaletteProblem)} - TABLE - set(NOT_IN_THE_TABLE)
    named = {core for field in RENDER_FIELDS.values() for core in field.core}
    known = {each.name for kind in (RenderSettings, render_settings.Sampling) for each in fields(kind)}
    assert named == known - set(NOT_IN_RENDER)
    assert set(OTHER_PALETTE) == set(PALETTE_FIELDS)
    assert set(OTHER_RENDER) == set(RENDER_FIELDS)
    assert set(OTHER_VOLUME) == set(VOLUME_FIELDS)


def test_defaults_and_options_are_those_of_the_core(blender):
    scene = blender.context.scene
    stated = palette_settings.settings_of(scene.spectral.palette)
    for each in fields(PaletteProblem):
        if each.name in stated and each.name != "grid":
            assert same(stated[each.name], each.default), each.name
    hints = get_type_hints(PaletteProblem)
    for field in PALETTE_FIELDS.values():
        known = get_args(hints[field.core[0]])
        if field.choices and known and isinstance(known[0], str):
            assert field.choices == known, field.name
    assert VOLUME_FIELDS["rule"].choices == ("auto", *RULES)
    assert VOLUME_FIELDS["lighting"].choices == tuple(LIGHTING)
    plain = RenderSettings()
    for core in (core for field in RENDER_FIELDS.values() for core in field.core if hasattr(plain, core)):
        assert getattr(render_settings.settings_of(scene), core) == getattr(plain, core)
    volume = {each.name: each.default for each in fields(VolumeObject)}
    stated = volume_look.look_of(blender.data.volumes.new("v").spectral)
    assert (stated["rule"], stated["quality"]) == (volume["rule"], volume["quality"])


def test_the_white_of_a_light_that_looks_white_is_that_of_the_core():
    from spectral_core.spectra.color import WHITE_XYZ as CORE

    np.testing.assert_allclose(WHITE_XYZ, CORE, rtol=1e-7)


@pytest.mark.parametrize("name", PALETTE_FIELDS)
@pytest.mark.parametrize("check", [kept_in_the_core, kept_in_the_table, kept_in_a_document, kept_by_the_session])
def test_a_palette_setting_is_kept(palette, check, name):
    assert check(palette, name)


@pytest.mark.parametrize("name", PALETTE_FIELDS)
def test_a_palette_setting_missing_in_the_problem_is_detected(palette, monkeypatch, name):
    monkeypatch.setattr(palette_settings, "PALETTE_FIELDS", without(PALETTE_FIELDS, name))
    assert not kept_in_the_core(palette, name)


@pytest.mark.parametrize("name", PALETTE_FIELDS)
def test_a_palette_setting_missing_in_the_table_is_detected(palette, monkeypatch, name):
    stored = palette_settings.store_settings

    def lacking(target, problem):
        with monkeypatch.context() as patched:
            patched.setattr(palette_settings, "PALETTE_FIELDS", without(PALETTE_FIELDS, name))
            return stored(target, problem)

    monkeypatch.setattr("blender_addon.translate.palette.load.store_settings", lacking)
    assert not kept_in_the_table(palette, name)


@pytest.mark.parametrize("name", [name for name in PALETTE_FIELDS if not name.startswith("grid_")])
def test_a_palette_setting_missing_in_documents_is_detected(palette, monkeypatch, name):
    lost = PALETTE_FIELDS[name].core
    monkeypatch.setattr(documents, "fields", lambda kind: [each for each in fields(kind) if each.name not in lost])
    assert not kept_in_a_document(palette, name)


@pytest.mark.parametrize("name", [name for name in PALETTE_FIELDS if not name.startswith("grid_")])
def test_a_palette_setting_missing_in_the_schema_is_detected(palette, monkeypatch, name):
    known = documents.PALETTE_SCHEMA.content
    settings = known["$defs"]["settings"]
    kept = {key: value for key, value in settings["properties"].items() if key not in PALETTE_FIELDS[name].core}
    lacking = {**known, "$defs": {**known["$defs"], "settings": {**settings, "properties": kept}}}
    monkeypatch.setattr(Schema, "content", lacking)
    assert not kept_in_a_document(palette, name)


@pytest.mark.parametrize("name", [name for name in PALETTE_FIELDS if not name.startswith("grid_")])
def test_a_palette_setting_missing_in_live_editing_is_detected(palette, monkeypatch, name):
    from blender_addon.editing.palette import session

    lost = PALETTE_FIELDS[name].core
    monkeypatch.setattr(session, "fields", lambda kind: [each for each in fields(kind) if each.name not in lost])
    assert not kept_by_the_session(palette, name)


def kept_in_a_render(scene, name) -> bool:
    scene.spectral.render.goal = GOALS.get(name, "SAMPLES")
    before = {**vars(render_settings.sampling_of(scene)), "settings": render_settings.settings_of(scene)}
    setattr(scene.spectral.render, name, OTHER_RENDER[name])
    after = {**vars(render_settings.sampling_of(scene)), "settings": render_settings.settings_of(scene)}
    core = RENDER_FIELDS[name].core[0]
    if core in after:
        return after[core] == OTHER_RENDER[name] != before[core]
    got = getattr(after["settings"], core)
    wanted = "spectral" if name == "transport" else OTHER_RENDER[name]
    return (
        got == wanted and replace(after["settings"], **{core: getattr(before["settings"], core)}) == before["settings"]
    )


@pytest.mark.parametrize("name", RENDER_FIELDS)
def test_a_render_setting_is_kept_and_its_absence_is_detected(blender, monkeypatch, name):
    scene = blender.context.scene
    assert kept_in_a_render(scene, name)
    scene.spectral.render.property_unset(name)
    monkeypatch.setattr(render_settings, "RENDER_FIELDS", without(RENDER_FIELDS, name))
    with contextlib.suppress(TypeError):  # without a default the dataclass itself refuses
        assert not kept_in_a_render(scene, name)


@pytest.mark.parametrize("name", VOLUME_FIELDS)
def test_a_volume_setting_is_kept_and_its_absence_is_detected(blender, monkeypatch, name):
    settings = blender.data.volumes.new("v").spectral
    setattr(settings, name, OTHER_VOLUME[name])

    def kept() -> bool:
        return volume_look.look_of(settings).get(VOLUME_FIELDS[name].core[0]) == OTHER_VOLUME[name]

    assert kept()
    monkeypatch.setattr(volume_look, "VOLUME_FIELDS", without(VOLUME_FIELDS, name))
    assert not kept()


def test_panels_show_every_declared_setting():
    shown = set()
    for file in Path(panels.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "prop":
                shown |= {arg.value for arg in node.args[1:2] if isinstance(arg, ast.Constant)}
    assert {*PALETTE_FIELDS, *RENDER_FIELDS, *VOLUME_FIELDS} <= shown


def test_copying_a_target_copies_the_whole_request_of_a_cell(palette):
    cell = palette.materials[0].cells[0]
    results = {"actual_linear", "wanted_linear", "actual_display", "wanted_display", "has_result", "delta_e", "actual",
               "wanted", "name", "rna_type", "others"}  # fmt: skip
    assert set(ASKED) == {prop.identifier for prop in cell.bl_rna.properties} - results


def test_a_path_relative_to_the_file_is_not_marked_as_wrong(registered):
    """From 5.0 on, Blender shows a path that starts with // in red, unless the property allows it."""
    import inspect
    import sys

    found = 0
    if "is_path_supports_blend_relative" not in registered.types.StringProperty.bl_rna.properties:
        pytest.skip("before 5.0 every path may")
    within = ("blender_addon.properties.", "blender_addon.preferences")
    modules = [module for name, module in sys.modules.items() if name.startswith(within)]
    for kind in {one for module in modules for _, one in inspect.getmembers(module, inspect.isclass)}:
        if not hasattr(kind, "bl_rna") or not kind.__module__.startswith("blender_addon"):
            continue
        for field in kind.bl_rna.properties:
            if field.type == "STRING" and field.subtype in {"FILE_PATH", "DIR_PATH"}:
                assert field.is_path_supports_blend_relative, f"{kind.__name__}.{field.identifier}"
                found += 1
    assert found >= 7


def test_cells_mark_the_difference_that_reports_count_as_visible() -> None:
    """A copy: the palette's package takes long to import, and properties are registered with Blender."""
    assert VISIBLE_DELTA_E == DECLARED_VISIBLE_DELTA_E
