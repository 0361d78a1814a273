# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering: a plan of what to simulate, Mitsuba to simulate it, in this process or in one of its own."""

from spectral_core.render.cost.curve import CostCurve, cost_curve
from spectral_core.render.plan.effects import Decision, EffectPlan, everything_on, plan_effects, plan_from_data
from spectral_core.render.process.renderer import RenderProcess
from spectral_core.render.result import Progress, RenderResult
from spectral_core.render.still import render_scene
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.render.variant import Backend, choose_backend, describe_backend

__all__ = [
    "Backend", "Bands", "CostCurve", "Decision", "EffectPlan", "Progress", "RenderProcess", "RenderResult",
    "choose_backend", "cost_curve", "describe_backend", "everything_on", "plan_effects", "plan_from_data",
    "render_scene",
]  # fmt: skip
