# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixes of many shaders: leaves of equal build are rows of a table, and nobody can tell from the picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    AddSurface,
    Color,
    Computed,
    Diffuse,
    Film,
    Glossy,
    MixSurface,
    PointLight,
    Transparent,
    World,
)
from tests.render.scenes import lit_plane, matrix
from tests.render.test_programs import noise_program

pytest.importorskip("mitsuba")


def _mixed(leaves, rng, factor=None):
    surface = leaves[0]
    for leaf in leaves[1:]:
        share = float(rng.random()) if factor is None else factor(rng)
        surface = AddSurface(surface, leaf) if rng.random() < 0.1 else MixSurface(share, surface, leaf)
    return surface


def _glossy(rng):
    return Glossy(Color(rng.random(3)), 0.1 + 0.8 * float(rng.random()))


def _picture(surface, transport="rgb"):
    lamp = PointLight(name="lamp", world_from_light=matrix((1, 0, 2)), power_w=100.0)
    scene = lit_plane(lamp, surface=surface, film=Film(8, 8, samples=8), transport=transport)
    return render_scene(replace(scene, world=World(Color([0.3, 0.4, 0.5])))).pixels


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_table_of_leaves_renders_as_the_leaves_do(monkeypatch, transport):
    from spectral_core.render.mitsuba_scene import leaf_rows

    rng = np.random.default_rng(5)
    matt = [Diffuse(Color(rng.random(3))) for _ in range(3)]
    noisy = [Diffuse(Computed(noise_program(2.0 + k))) for k in range(3)]
    clear = [Transparent(Color(rng.random(3))) for _ in range(3)]
    leaves = [*(_glossy(rng) for _ in range(3)), *matt, *noisy, *clear, Glossy(Color([0.2, 0.3, 0.4]), 0.0)]
    order = rng.permutation(len(leaves))
    surface = _mixed(
        [leaves[k] for k in order], rng, lambda r: Computed(noise_program(1.0)) if r.random() < 0.2 else 0.3
    )
    together = _picture(surface, transport)
    monkeypatch.setattr(leaf_rows, "FEWEST", 1000)
    alone = _picture(surface, transport)
    assert alone[..., :3].std() > 0
    # the same leaves in another order are drawn by other numbers, so pictures agree but for noise
    np.testing.assert_allclose(together.mean((0, 1)), alone.mean((0, 1)), rtol=0.05)


def test_more_leaves_of_equal_build_need_no_new_kernel():
    import drjit

    rng = np.random.default_rng(7)
    _picture(_mixed([_glossy(rng) for _ in range(12)], rng))
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
        drjit.kernel_history_clear()
        for count in (40, 120):
            assert np.isfinite(_picture(_mixed([_glossy(rng) for _ in range(count)], rng))).all()
        history = drjit.kernel_history()
    traced = [kernel for kernel in history if kernel.get("operation_count", 0) > 500]
    assert len(traced) >= 4
    assert all(kernel["cache_hit"] for kernel in traced)
