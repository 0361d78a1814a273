# SPDX-License-Identifier: GPL-3.0-or-later
"""Alternatives, tints and fluorescent dyes through the palette's own operators."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.translate.spectra.stored import spectrum_of


@pytest.fixture
def palette(blender):
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    return blender.context.scene.spectral.palette


def shown(palette, name="actual_linear"):
    return np.array([[tuple(getattr(cell, name)) for cell in material.cells] for material in palette.materials])


def test_alternatives_are_found_selected_and_found_again_with_a_locked_material(blender, palette) -> None:
    before = shown(palette)
    palette.alternative_count = 3
    blender.ops.spectral.palette_alternatives()
    assert len(palette.alternatives) == 3
    assert palette.alternatives[1].apart > 3
    assert np.array(json.loads(palette.alternatives[1].colors)).shape[2] == 3
    blender.ops.spectral.palette_alternative_take(index=1)
    np.testing.assert_allclose(shown(palette), before, atol=1e-4)  # every cell of this table has a request
    kept = spectrum_of(palette.materials[0], "result").values
    stored = json.loads(palette.alternatives[1].spectra)[str(palette.materials[0].uid)]
    np.testing.assert_allclose(kept, stored["values"], atol=1e-5)
    palette.materials[0].locked = True
    blender.ops.spectral.palette_alternatives(seed=2)
    for answer in palette.alternatives:
        stored = json.loads(answer.spectra)[str(palette.materials[0].uid)]
        np.testing.assert_allclose(stored["values"], kept, atol=1e-5)
    with pytest.raises(RuntimeError, match="there is no alternative 9"):
        blender.ops.spectral.palette_alternative_take(index=9)


def test_tints_match_if_requested(blender, palette) -> None:
    from blender_addon.translate.palette.problem import palette_problem
    from spectral_core.palette import solve_palette
    from spectral_core.palette.paint.mixtures import tint_differences

    plain = solve_palette(palette_problem(palette))
    palette.use_tints, palette.tint_weight = True, 1.0
    assert palette.is_stale
    blender.ops.spectral.palette_solve()
    assert palette.status
    assert not palette.message
    spectra = [spectrum_of(material, "result").values for material in palette.materials]
    apart = [np.abs(spectra[0] - spectra[1]).max(), np.abs(plain.reflectances[0].values - spectra[0]).max()]
    assert min(apart) > 1e-3  # the spectra differ from those without tints, and from each other
    assert float(tint_differences(plain, [(0, 1)], base=0.9, levels=(0.5,)).max()) > 1


def test_a_dye_is_designed(blender) -> None:
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = blender.context.scene.spectral.palette
    palette.active_row = 0
    blender.ops.spectral.palette_dye()
    dye = palette.materials[0].dyes[0]
    dye.excitation_nm, dye.emission_nm = 380, 530
    with pytest.raises(RuntimeError, match="begin at 360 nm"):
        blender.ops.spectral.palette_solve()
    palette.grid_start, palette.grid_stop, palette.grid_samples = 360, 720, 37
    palette.lights[0].design = palette.lights[1].design = "MEASURED"
    blender.ops.spectral.palette_solve()
    assert palette.status
    assert dye.amount >= 0
    if dye.amount > 1e-4:
        assert "Apply to Scene gives materials their dyes" in palette.notes
    palette.use_tints = True
    with pytest.raises(RuntimeError, match="not designed together"):
        blender.ops.spectral.palette_solve()
    palette.use_tints = False
    blender.ops.spectral.palette_dye(index=0)
    assert not len(palette.materials[0].dyes)
    with pytest.raises(RuntimeError, match="there is no dye 3"):
        blender.ops.spectral.palette_dye(index=3)


def test_tints_and_dyes_are_designed_with_the_settings_of_the_table(palette, monkeypatch) -> None:
    from blender_addon.translate.palette.paint import solver_of
    from blender_addon.translate.palette.problem import palette_problem
    from spectral_core.palette.paint import fluorescent_design, fluorescent_report, tints

    asked = {}
    monkeypatch.setattr(tints, "solve_with_tints", lambda _problem, criterion: asked.update(weight=criterion.weight))
    palette.use_tints, palette.tint_weight = True, 3.5
    solver_of(palette).solve(palette_problem(palette), None)
    assert asked["weight"] == pytest.approx(3.5)

    def designed(_problem, dyes, start):
        asked.update(dyes=dyes, start=start)
        return SimpleNamespace(surfaces={0: SimpleNamespace(amounts=[0.25])})

    monkeypatch.setattr(fluorescent_design, "solve_fluorescent", designed)
    monkeypatch.setattr(fluorescent_report, "palette_solution", lambda found: found)
    palette.use_tints = False
    dye = palette.materials[0].dyes.add()
    dye.excitation_nm, dye.emission_nm = 431, 562
    solver = solver_of(palette)
    solver.solve(palette_problem(palette), None)
    solver.store(palette)
    assert [each.name for each in asked["dyes"][0]] == ["dye 431 to 562 nm"]
    assert dye.amount == pytest.approx(0.25)
