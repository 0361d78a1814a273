# SPDX-License-Identifier: GPL-3.0-or-later
"""Emission of surfaces, and the weights of their closures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.scene import Computed, Emission, Paint, Principled, Scalar, Surface, Weight, leaves, weighted_leaves


def weight_texture(context: Context, weight: Weight, subject: str) -> Any:
    """A weight as a Mitsuba texture."""
    result = context.constant(weight.constant)
    zero, one = context.constant(0.0), context.constant(1.0)
    for value, complement in weight.varying:
        factor = paint.scalar_texture(context, value, subject)
        ends = {"first": one, "second": zero} if complement else {"first": zero, "second": one}
        amount = context.load({"type": "mixed_paint", "factor": factor, **ends})
        result = context.load({"type": "product_paint", "color": result, "amount": amount})
    return result


def sheen_clear(context: Context, closure: Principled, subject: str, normal: Computed | None = None) -> Any:
    """Share of light that the sheen of a Principled surface transmits to the layers below, as a factor of a weight."""
    description: dict[str, Any] = {
        "type": "sheen_clear",
        "weight": paint.scalar_texture(context, closure.sheen_weight, subject),
        "roughness": paint.scalar_texture(context, closure.sheen_roughness, subject),
        "color": paint.reflectance(context, closure.sheen_tint, subject),
    }
    if normal is not None:
        description["normal"] = context.computed(normal.program)
    return paint.Made(context.load(description))


def is_dark(surface: Surface | None) -> bool:
    """True if a surface emits nothing."""
    emitted = [c.strength if isinstance(c, Emission) else getattr(c, "emission_strength", 0.0) for c in leaves(surface)]
    return all(isinstance(strength, (int, float)) and strength == 0 for strength in emitted)


def emission(context: Context, surface: Surface | None, subject: str) -> Any | None:
    """Texture of the radiance that a surface emits; None if it does not emit."""
    terms = []
    for weight, closure, emitted in emitting(surface):
        if isinstance(closure, Principled) and closure.sheen_weight != 0:
            weight = weight.times(sheen_clear(context, closure, subject))
        term = _emission_term(context, emitted, weight, subject)
        if term is not None:
            terms.append(term)
    if not terms:
        return None
    total = terms[0]
    half = context.load({"type": "uniform", "value": 0.5})
    for term in terms[1:]:  # twice a mix of equal parts is the sum
        total = context.load({"type": "mixed_paint", "factor": half, "first": total, "second": term, "scale": 2.0})
    return total


def emitting(surface: Surface | None) -> Iterator[tuple[Weight, Any, tuple[Paint, Scalar]]]:
    """Closures of a surface that may emit: their weights, and the color and the strength of their emission."""
    for weight, closure in weighted_leaves(surface):
        if isinstance(closure, Emission):
            yield weight, closure, (closure.color, closure.strength)
        elif isinstance(closure, Principled):
            yield weight.times(closure.alpha), closure, (closure.emission_color, closure.emission_strength)


def _emission_term(context: Context, emitted: tuple[Any, Scalar], weight: Weight, subject: str) -> Any | None:
    color, strength = emitted
    constant = float(strength) if isinstance(strength, (int, float)) else 1.0
    constant *= weight.constant
    if constant == 0:
        return None
    texture = paint.emission(context, color, constant, subject)
    if weight.varying:
        amount = weight_texture(context, Weight(weight.varying), subject)
        texture = context.load({"type": "product_paint", "color": texture, "amount": amount})
    if not isinstance(strength, (int, float)):
        amount = paint.scalar(context, strength, subject)
        texture = context.load({"type": "product_paint", "color": texture, "amount": amount})
    return texture
