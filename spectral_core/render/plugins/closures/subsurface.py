# SPDX-License-Identifier: GPL-3.0-or-later
"""``subsurface``: light enters here and leaves elsewhere; the path integrator finds the exit.

A sample of this type is no direction. Its ``wo`` holds the radii of red, green and blue, its ``eta`` the anisotropy,
its ``sampled_component`` what light does at the entry (``packed``), its ``pdf`` the factor of the layers above, and its
weight the visible color.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.plugins.closures.facets.upright import with_valid_normal
from spectral_core.render.plugins.closures.lobe import Closure, register_closure

SHORTEST = 1e-4
"""Least radius of a walk: its steps must be longer than the offset of its start."""
NO_RADIUS = 1e-8
"""Radius up to which light leaves where it entered (Cycles)."""
DIVES = 1 << 30
"""Bit of a sample's type, beside Mitsuba's own."""
MODELS = ("random_walk", "random_walk_skin", "burley")
"""Models of light below the surface, by their number."""
IORS = (1.01, 3.8)
"""Range of the index of refraction at the entry (Cycles)."""
MOST_ANISOTROPY = 0.9
ALPHA_STEPS, IOR_STEPS = (1 << 14) - 1, (1 << 16) - 1


@dataclass
class Entry:
    """What light does where it enters: facets of ``alpha`` refract it; a skin scatters half of it evenly."""

    anisotropy: Any
    alpha: Any
    ior: Any
    is_skin: Any
    is_disk: Any


def packed(mi: Any, dr: Any, alpha: Any, ior: Any, model: int) -> Any:
    """Alpha of the facets, index of refraction and model as one integer."""
    low, high = IORS
    steps = mi.UInt32(dr.clip(alpha, 0.0, 1.0) * ALPHA_STEPS + 0.5)
    index = mi.UInt32(dr.clip((ior - low) / (high - low), 0.0, 1.0) * IOR_STEPS + 0.5)
    return (index << 16) | (steps << 2) | model


def entry_of(mi: Any, dr: Any, bs: Any) -> Entry:
    """What a sample says of the entry."""
    code, (low, high) = mi.UInt32(bs.sampled_component), IORS
    model = code & 3
    alpha = mi.Float((code >> 2) & ALPHA_STEPS) / ALPHA_STEPS
    is_skin = model == MODELS.index("random_walk_skin")
    return Entry(
        anisotropy=dr.clip(bs.eta, 0.0, MOST_ANISOTROPY),
        alpha=dr.select(is_skin, 1.0, alpha),
        ior=low + (high - low) * (mi.Float(code >> 16) / IOR_STEPS),
        is_skin=is_skin,
        is_disk=model == MODELS.index("burley"),
    )


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""

    class Subsurface(Closure):
        """``color``; ``scale``, ``anisotropy``, ``ior`` and ``roughness`` (numbers); ``radius`` (a vector) or
        ``radius_0`` to ``radius_2`` (numbers); the ``model``; ``squares``: whether alpha is the roughness squared.
        """

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.m_flags = int(mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)
            self.inputs, self.color, self.dives = inputs, inputs["color"], True
            self.model, self.squares = MODELS.index(inputs["model"]), bool(inputs["squares"])

        def radius(self, si: Any, active: Any) -> Any:
            """Radii of red, green and blue."""
            if "radius" in self.inputs:
                return mi.Vector3f(mi.Color3f(self.inputs["radius"].eval_3(si, active)))
            return mi.Vector3f(*(self.inputs[f"radius_{k}"].eval_1(si, active) for k in range(3)))

        def normal_below(self, si: Any, active: Any) -> Any:
            return mi.Vector3f(with_valid_normal(mi, dr, si).sh_frame.n)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs = dr.zeros(mi.BSDFSample3f)
            number = lambda name: self.inputs[name].eval_1(si, active)  # noqa: E731
            radius = self.radius(si, active) * dr.maximum(number("scale"), 0.0)
            bs.wo = dr.select(radius > NO_RADIUS, dr.maximum(radius, SHORTEST), 0.0)
            bs.eta, bs.pdf = number("anisotropy"), mi.Float(1.0)
            rough = dr.clip(number("roughness"), 0.0, 1.0)
            bs.sampled_component = packed(mi, dr, rough * rough if self.squares else rough, number("ior"), self.model)
            bs.sampled_type = mi.UInt32(DIVES)
            return bs, dr.select(active, self.color.eval(si, active), 0.0)

    register_closure(mi, "subsurface", Subsurface)
