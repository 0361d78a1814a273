# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixes of many shaders: their leaves are rows of tables, and nobody can tell from the picture."""

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


def _picture(surface, transport="rgb", samples=8):
    lamp = PointLight(name="lamp", world_from_light=matrix((1, 0, 2)), power_w=100.0)
    scene = lit_plane(lamp, surface=surface, film=Film(8, 8, samples=samples), transport=transport)
    return render_scene(replace(scene, world=World(Color([0.3, 0.4, 0.5])))).pixels


def _chain(leaves, factors):
    surface = leaves[0]
    for leaf, factor in zip(leaves[1:], factors, strict=True):
        surface = MixSurface(factor, surface, leaf)
    return surface


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_mix_renders_as_the_weighted_sum_of_its_leaves(transport):
    """One kernel serves every mix: a factor near 0 or 1 shows one leaf, any other their sum."""
    rng = np.random.default_rng(5)
    leaves = [
        _glossy(rng),
        Diffuse(Color(rng.random(3))),
        Transparent(Color(rng.random(3))),
        Diffuse(Computed(noise_program(2.0))),
        _glossy(rng),
        Glossy(Color([0.2, 0.3, 0.4]), 0.0),
    ]
    factors = [0.3, 0.4, 0.25, 0.5, 0.2]
    weights, rest = [], 1.0
    for factor in reversed(factors):
        weights.insert(0, rest * factor)
        rest *= 1 - factor
    weights.insert(0, rest)
    alone = []
    for chosen in range(len(leaves)):
        only = [1 - 1e-6 if k == chosen else 1e-6 for k in range(1, len(leaves))]
        alone.append(_picture(_chain(leaves, only), transport, 64)[..., :3].mean((0, 1)))
    assert np.std(alone, axis=0).min() > 0.05
    together = _picture(_chain(leaves, factors), transport, 64)[..., :3].mean((0, 1))
    np.testing.assert_allclose(together, np.array(weights) @ np.array(alone), rtol=0.03)


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
