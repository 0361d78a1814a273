# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders compared with formulas that share no code with the renderer: furnaces, a glass slab, a prism, lamps."""

from __future__ import annotations

import pytest

pytest.importorskip("mitsuba")


@pytest.mark.parametrize("name", ["prism", "lamps", "thin-film", "fluorescence"])
def test_a_closed_form_holds_within_noise(name):
    from benchmarks.render.checks.closed_cases import CASES

    found = list(CASES[name][0](64, "rgb"))
    assert len(found) >= 12
    assert [each for each in found if not each.agrees] == []


def test_a_slab_follows_fresnel_with_all_internal_reflections():
    from itertools import islice

    from benchmarks.render.checks.closed_forms import slab

    found = list(islice(slab(256, "rgb"), 8, 16))  # index 1.5
    assert [each for each in found if not each.agrees] == []
    passed = [each for each in found if "through" in each.case]
    assert max(each.error for each in passed) < 0.015  # noise is smaller than the difference to a wrong formula


@pytest.mark.parametrize("name", ["Glossy, Beckmann", "Glossy, GGX, multiple scattering", "Principled, coat"])
def test_no_surface_reflects_more_light_than_it_receives(name):
    """The largest directional albedo over roughness and angle, including 89 degrees and the inner side."""
    from benchmarks.render.checks.furnace_scenes import SURFACES, tile_albedos

    albedo, noise, lost = tile_albedos(SURFACES[name], 128, "rgb")
    assert (albedo - 4.5 * noise).max() < 1.002 and lost == 0
