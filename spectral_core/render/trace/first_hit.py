# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera rays up to the first visible hit: they pass lamps that are invisible to cameras and, for a film with a
transparent background, transparent surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.checks import read_only_when_copied
from spectral_core.render.mitsuba_scene.rules import HOLDOUT, Tables
from spectral_core.render.plugins.closures.holdout import QUESTION
from spectral_core.render.plugins.paints.ray_marks import camera_marks
from spectral_core.render.trace.media import flight as flights
from spectral_core.render.trace.media.starts import at_start
from spectral_core.scene import Rays

MOST_LAYERS = 64
"""Most surfaces that one camera ray may pass; after as many, the pixel counts as covered by the environment."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class FirstHit:
    """Traces camera rays of one loaded scene.

    ``transparent``: the environment is not visible directly, and not part of radiance and coverage. Holdouts cut holes
    into either type of film.
    """

    mitsuba: Any
    scene: Any
    transparent: bool
    background: Any | None = None
    """The emitter that the camera sees behind everything, None for black."""
    rules: Tables | None = None
    """The shapes that the camera does not see, and the holdouts."""
    shows_lamps: bool = False
    """True if the camera sees lamps, which shine in front of a transparent background too."""
    home: Any = None
    """The ``LoadedScene``: programs that send rays find the scene only as long as it exists, and every tracer has this
    object.
    """
    layers: Any = None
    """Most surfaces that a path passes straight (UInt32, 0 as 1), which cover the picture beyond; None for no limit."""

    @property
    def looks_through(self) -> bool:
        """True if a pixel may be covered in part."""
        return self.transparent or (self.rules is not None and self.rules.cuts_holes)

    def straight_through(self, ray: Any, sampled: Any = None) -> tuple[Any, Any, Any]:
        """Share of the pixel that nothing covers straight along ``ray``, per wavelength, the light that is visible
        there, and True if the camera sees a surface that lets light pass, even one that covers nothing.

        ``sampled``: the ``SampledVolumes`` between surfaces. A holdout covers nothing and emits nothing. If the film is
        not transparent, the environment covers.
        """
        import drjit as dr

        mi = self.mitsuba
        fills = None if self.rules is None else self.rules.media

        def body(origin: Any, length: Any, passed: Any, hole: Any, fog: Any, counts: Any, walking: Any) -> Any:
            si, met, unseen, is_hole = self.meet(ray, origin, length, walking)
            way = dr.select(si.is_valid(), si.t, length)
            if sampled is not None:
                passed *= sampled.seen_through(origin, ray.d, way, walking)
            clear = self.surface(si).eval_null_transmission(si, met & ~unseen)
            # a holdout leaves what its transparent parts show of the things behind it, as in Cycles
            hole = dr.select(is_hole, hole + passed * (1.0 - clear), hole)
            if self.rules is not None and self.rules.has_holdout_surfaces:
                si.dn_dv = mi.Vector3f(QUESTION, 0.0, 0.0)
                share = self.surface(si).eval_null_transmission(si, met & ~unseen & ~is_hole) - clear
                hole = dr.select(met & ~unseen & ~is_hole, hole + passed * dr.maximum(share, 0.0), hole)
            passed = dr.select(met & ~unseen, passed * clear, passed)
            if self.rules is not None and fills is not None:
                way = dr.select(si.is_valid(), si.t, dr.inf)
                # a medium that varies depends on where the piece begins
                piece = mi.Ray3f(ray)
                piece.o = origin
                passed = dr.select(walking, passed * flights.clear(fills, fog, way, piece, walking), passed)
                fog = fills.crossed(fog, self.rules.shape_number(si), si, (ray.d, ray.d), met & ~unseen)
            layers, straight, sees = counts
            # it may emit light; a holdout emits none
            sees |= met & ~unseen & ~is_hole & (dr.max(clear) > 0.0)
            onward = met & (dr.max(passed) > 0.0) & (layers + 1 < MOST_LAYERS)
            if self.layers is not None and self.rules is not None:
                # as many as the path itself counts: beyond them it ends before the environment, which is subtracted
                own = met & ~unseen
                own &= True if fills is None else ~fills.is_border(self.rules.shape_number(si), own)
                onward &= ~own | (straight < dr.maximum(self.layers, 1))
                straight = dr.select(own, straight + 1, straight)
            # a walk that ends at the limit has not reached the environment
            passed = dr.select(met & ~onward, 0.0, passed)
            origin = dr.select(onward, si.spawn_ray(ray.d).o, origin)
            return (
                origin,
                dr.select(onward, length - si.t, length),
                passed,
                hole,
                fog,
                (layers + 1, straight, sees),
                onward,
            )

        fog = mi.UInt32(0), mi.UInt32(0)
        if self.rules is not None:
            fog = at_start(self.rules, self.scene, ray, mi.Bool(True))
        clear, hidden = mi.Spectrum(1.0), mi.Spectrum(0.0)
        counts = mi.UInt32(0), mi.UInt32(0), mi.Bool(False)
        start = (mi.Point3f(ray.o), mi.Float(ray.maxt), clear, hidden, fog, counts, mi.Bool(True))
        _, _, passed, hole, _, counts, _ = dr.while_loop(start, lambda _o, _l, _p, _h, _f, _n, walking: walking, body)
        if not self.transparent:
            return hole, mi.Spectrum(0.0), counts[2]
        environment = self.background
        if environment is None:
            return passed + hole, mi.Spectrum(0.0), counts[2]
        miss = dr.zeros(mi.SurfaceInteraction3f)
        miss.wi, miss.wavelengths, miss.t = -ray.d, ray.wavelengths, mi.Float(dr.inf)
        miss.dn_dv = camera_marks(mi)
        return passed + hole, passed * environment.eval(miss), counts[2]

    def intersect(self, ray: Any, active: Any) -> Any:
        """The nearest hit of a ray."""
        assert self.rules is not None, "a scene without tables has no rules of shapes"
        return self.rules.intersect(self.scene, ray, active)

    def meet(self, ray: Any, origin: Any, length: Any, walking: Any) -> tuple[Any, Any, Any, Any]:
        """The next hit of a camera ray from ``origin``, within ``length``.

        Returns the hit, whether it is one, whether the camera passes it unseen, and whether it is a holdout.
        """
        import drjit as dr

        mi = self.mitsuba
        probe = mi.Ray3f(ray)
        probe.o, probe.maxt = origin, length
        if self.rules is not None and self.rules.counts_lengths:
            probe.time = dr.norm(origin - ray.o)
        si = self.intersect(probe, walking)
        si.dn_du, si.dn_dv = -ray.d, camera_marks(mi)
        met = walking & si.is_valid()
        return si, met, *self._rules_of(si, met)

    def surface(self, si: Any) -> Any:
        """The BSDF of the surface at a hit."""
        assert self.rules is not None, "a scene without tables has no surfaces"
        return self.rules.surface(si)

    def _rules_of(self, si: Any, met: Any) -> tuple[Any, Any]:
        """True if the camera passes the hit, and True if it is a holdout."""
        mi = self.mitsuba
        if self.rules is None or self.rules.shapes is None:
            return mi.Bool(False), mi.Bool(False)
        bits = self.rules.look_up(self.rules.shapes, self.rules.shape_number(si))
        unseen = met & ((bits & int(Rays.CAMERA)) != 0)
        return unseen, met & ~unseen & ((bits & HOLDOUT) != 0)
