# SPDX-License-Identifier: GPL-3.0-or-later
"""What lies behind smooth glass on a transparent film (Transparent Glass): the environment and holdouts are holes."""

from __future__ import annotations

from typing import Any

from spectral_core.render.mitsuba_scene.rules import HOLDOUT
from spectral_core.render.plugins.closures.holdout import QUESTION
from spectral_core.render.plugins.numbers import channel_mean
from spectral_core.scene import Rays


def through_glass(met: Any, si: Any, path: Any, active: Any, *, counts: bool) -> None:
    """Move the environment behind smooth glass from a ray's light to ``behind_glass``; ``counts``: add its share to
    ``through``.
    """
    import drjit as dr
    import mitsuba as mi

    gone = active & ~si.is_valid() & path.clear & (path.depth > 0)
    met.behind_glass = dr.select(gone, met.world, 0.0)
    met.world = dr.select(gone, mi.Spectrum(0.0), met.world)
    if counts:
        path.through = dr.select(gone, path.through + channel_mean(dr, path.throughput), path.through)


def is_hole(integrator: Any, shape: Any, path: Any) -> Any:
    """True if a ray hits a holdout, which shows only what is behind its transparent parts: a ray of the camera, or
    with Transparent Glass one that has passed nothing but smooth glass.
    """
    import mitsuba as mi

    if not integrator.tables.has_holdout_shapes:
        return mi.Bool(False)
    bits = integrator.tables.look_up(integrator.tables.shapes, shape)
    sees = (path.kind & int(Rays.CAMERA)) != 0
    return ((bits & HOLDOUT) != 0) & ((sees | path.clear) if integrator.settings.clear_glass else sees)


def cut_holes(integrator: Any, si: Any, bsdf: Any, path: Any, places: tuple[Any, Any]) -> None:
    """Leave a ray the share that the transparent parts of a holdout transmit.

    Behind smooth glass the rest is added to ``through``, as is the share of holdout closures. ``places``: true on a
    surface, and on a holdout.
    """
    import drjit as dr
    import mitsuba as mi

    tables, (hit, hole) = integrator.tables, places
    # in front of glass ``FirstHit.straight_through`` measures the holes
    behind, share = path.clear & (path.depth > 0), mi.Spectrum(0.0)
    clear = bsdf.eval_null_transmission(si, hole) if tables.has_holdout_shapes else mi.Spectrum(1.0)
    if integrator.settings.clear_glass:
        share = dr.select(hole & behind, 1.0 - clear, share)
        if tables.has_holdout_surfaces:
            # a marked hit counts holdout closures as transmission, see ``closures.holdout``
            asked, asks = mi.SurfaceInteraction3f(si), hit & behind
            asked.dn_dv = mi.Vector3f(QUESTION, 0.0, 0.0)
            closures = bsdf.eval_null_transmission(asked, asks) - bsdf.eval_null_transmission(si, asks)
            share = dr.select(asks, dr.maximum(closures, 0.0), share)
        path.through += channel_mean(dr, path.throughput * share)
    if tables.has_holdout_shapes:
        path.throughput *= dr.select(hole, clear, 1.0)
