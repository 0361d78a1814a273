# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescent closures: their reflection becomes a lobe, their emission is stored for the tables of the path
integrator.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.emission import weight_texture
from spectral_core.render.plugins.surfaces.sources import Lobe
from spectral_core.render.trace.reradiation import Dyed, Reradiation
from spectral_core.scene import Color, Fluorescent, Scene, Weight, leaves
from spectral_core.scene.paint import WHOLE
from spectral_core.spectra.color import RGB_FROM_XYZ, luminance_from_linear_rgb
from spectral_core.spectra.observer import STANDARD, integration_points, observer, xyz_of
from spectral_core.spectra.spectrum import Spectrum

IN_RGB = (
    "its dyes are shown as a color under daylight: RGB transport knows no other wavelengths; set Transport to Spectral "
    "for their emission under each light"
)
MOST_TIMES = 3
"""Lights that the emission of a dye counts as, at most."""
OVER_WHITE = "in daylight it emits more than RGB transport can show of a surface; its color is rendered at the limit"
ABOVE_BUMPS = "its dyes emit light about the smooth normal: bumps and normal maps affect only its reflection"


def fluorescent_lobes(
    context: Context, closure: Fluorescent, weight: Weight, subject: str
) -> Iterator[tuple[Weight, Lobe]]:
    """The reflection as a weighted lobe; the dyes are added to the context."""
    if not context.spectral:
        color = _daylight_color(context, closure, subject)
        yield weight, Lobe("diffuse", {"color": paint.color(context, color, subject)})
        return
    if any(amount > 0 for amount in closure.amounts):
        texture = None if weight == WHOLE else weight_texture(context, weight, subject)
        context.dyed.setdefault(subject, Dyed()).parts.append((closure, texture))
        if closure.normal is not None:
            context.note(subject, ABOVE_BUMPS)
    if not (isinstance(closure.color, Color) and not np.any(closure.color.linear_rgb)):
        yield weight, Lobe("diffuse", {"color": paint.color(context, closure.color, subject)})


def _daylight_color(context: Context, closure: Fluorescent, subject: str) -> Any:
    """Color of reflected and emitted light under D65, for RGB transport."""
    if not any(amount > 0 for amount in closure.amounts):
        return closure.color
    if not closure.checks_energy:
        context.note(subject, "its dyes emit no light: RGB transport cannot add it to a texture")
        return closure.color
    context.note(subject, IN_RGB)
    rgb = daylight_rgb(closure)
    if rgb.min() < 0 or rgb.max() > 1:
        context.note(subject, OVER_WHITE)
    return Color(np.clip(rgb, 0.0, 1.0))


def daylight_rgb(closure: Fluorescent, light: Spectrum | None = None) -> Any:
    """Linear sRGB (3,) of the reflected and emitted light under ``light``, D65 if None; a white surface has the color
    of the light.
    """
    light = light or paint.white_light()
    viewer, own = observer(STANDARD), closure.color
    color = [own.grid.wavelengths_nm] if isinstance(own, Spectrum) else []
    points, weights = integration_points(viewer.wavelengths_nm, light.grid.wavelengths_nm, *color)
    cmfs = np.stack([np.interp(points, viewer.wavelengths_nm, row) for row in viewer.cmfs])
    found = RGB_FROM_XYZ @ (cmfs @ (weights * closure.reflected(points) * light.at(points)))
    # apart: a lamp of one line has no wavelengths where its dyes emit
    for dye, amount in zip(closure.dyes, closure.amounts, strict=True):
        found = found + amount * dye.absorbed_power(light, dye.excitation.grid) * dye.emitted_rgb()
    return found


def has_dyes(scene: Scene) -> bool:
    """True if a material of the scene has an amount of a dye."""
    every = (leaf for material in scene.materials for leaf in leaves(material.surface))
    return any(isinstance(leaf, Fluorescent) and any(amount > 0 for amount in leaf.amounts) for leaf in every)


def emission_spectra(scene: Scene, lights: Sequence[Spectrum]) -> list[Spectrum]:
    """Emission spectra of the dyes of a scene's materials: wavelengths to trace beside those of its ``lights``.

    A dye that is brighter under one of them than a white surface occurs up to ``MOST_TIMES``, as so many lights.
    """
    found = []
    for material in scene.materials:
        for leaf in leaves(material.surface):
            if isinstance(leaf, Fluorescent):
                for dye, amount in zip(leaf.dyes, leaf.amounts, strict=True):
                    if amount > 0:
                        alone = Fluorescent(Color(np.zeros(3)), (dye,), (amount,))
                        brightest = max((_luminance(alone, light) for light in lights), default=0.0)
                        found += [dye.emission] * int(np.clip(round(brightest), 1, MOST_TIMES))
    return found


def _luminance(closure: Fluorescent, light: Spectrum) -> float:
    """Luminance of a dye, on black, under a light, over that of a white surface."""
    white = float(xyz_of(light)[1])
    sent = float(luminance_from_linear_rgb(daylight_rgb(closure, light)))
    return sent / white if white > 0 else 0.0


def reradiation(context: Context, lights: Sequence[Spectrum], teeth: int) -> Reradiation | None:
    """The reradiation tables of a loaded scene; None if nothing in it is fluorescent."""
    dyed = [item for item in context.dyed.values() if item.shapes]
    return Reradiation(context.mitsuba, dyed, lights, teeth) if dyed else None
