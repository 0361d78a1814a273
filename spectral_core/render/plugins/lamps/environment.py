# SPDX-License-Identifier: GPL-3.0-or-later
"""``tinted_environment``: an environment image whose colors tint another white than Mitsuba's D65;
``signed_environment``: one with colors below zero, which take light away as in Cycles; ``patterned_environment``: one
that sharp rays see in full detail.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.lamps.patterns import lamp_place
from spectral_core.render.plugins.paints.ray_marks import is_directed, is_sharp
from spectral_core.spectra.spectrum import FIRST_NM


def register(mi: Any, dr: Any) -> None:
    """Define and register the emitter for the active variant."""

    class TintedEnvironment(mi.Emitter):
        """``environment``: an ``envmap``, whose colors tint D65; ``white`` takes the place of ``daylight``, that D65.

        Both whites are linear between their knots, so their quotient is exact at every wavelength. Mitsuba's D65 has no
        ultraviolet below the visible wavelengths: there the colors have the tint of the shortest visible one.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.Infinite | mi.EmitterFlags.SpatiallyVarying
            self.m_needs_sample_3 = False
            self.environment = properties["environment"]
            self.white, self.daylight = properties["white"], properties["daylight"]

        def set_scene(self, scene: Any) -> None:
            self.environment.set_scene(scene)

        def visible(self, it: Any) -> Any:
            """The point, at visible wavelengths."""
            at = type(it)(it)
            at.wavelengths = dr.maximum(it.wavelengths, FIRST_NM)
            return at

        def tint(self, wavelengths: Any, active: Any) -> Any:
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wavelengths = wavelengths
            day = self.daylight.eval(self.visible(si), active)
            return dr.select(day > 0.0, self.white.eval(si, active) / day, 0.0)

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.environment.eval(self.visible(si), active) * self.tint(si.wavelengths, active)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds, weight = self.environment.sample_direction(self.visible(it), sample, active)
            ds.emitter = mi.EmitterPtr(self)
            return ds, weight * self.tint(it.wavelengths, active)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self.environment.pdf_direction(it, ds, active)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self.environment.eval_direction(self.visible(it), ds, active) * self.tint(it.wavelengths, active)

        def bbox(self) -> Any:
            return self.environment.bbox()

        def traverse(self, callback: Any) -> None:
            callback.put("environment", self.environment, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "TintedEnvironment"

    class SignedEnvironment(mi.Emitter):
        """``bright`` minus ``dark``, two environments; directions are drawn by a third, ``magnitude``."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.Infinite | mi.EmitterFlags.SpatiallyVarying
            self.m_needs_sample_3 = False
            self.bright, self.dark, self.magnitude = (properties[name] for name in ("bright", "dark", "magnitude"))

        def set_scene(self, scene: Any) -> None:
            for part in (self.bright, self.dark, self.magnitude):
                part.set_scene(scene)

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.bright.eval(si, active) - self.dark.eval(si, active)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds, _ = self.magnitude.sample_direction(it, sample, active)
            ds.emitter = mi.EmitterPtr(self)
            usable = active & (ds.pdf > 0.0)
            light = self.eval_direction(it, ds, usable) * dr.rcp(dr.maximum(ds.pdf, 1e-30))
            return ds, dr.select(usable, light, 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self.magnitude.pdf_direction(it, ds, active)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wi, si.wavelengths, si.t = -ds.d, it.wavelengths, mi.Float(dr.inf)
            return self.eval(si, active)

        def bbox(self) -> Any:
            return self.magnitude.bbox()

        def traverse(self, callback: Any) -> None:
            for name in ("bright", "dark", "magnitude"):
                callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "SignedEnvironment"

    class PatternedEnvironment(mi.Emitter):
        """``environment``: one drawn from a pattern, which lights the scene; ``pattern``: the texture of the pattern,
        which sharp rays see, as the marks of a hit tell them apart, and with ``tells_rays`` those of all glossy and
        transmitting lobes; with ``is_only_met`` no direction is drawn for it. ``to_world``: from the pattern's axes.

        The weights of both ways to reach the environment still add up to 1: where a sharp lobe is sampled either way,
        the light lies between the pattern and its mean over a pixel.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.Infinite | mi.EmitterFlags.SpatiallyVarying
            self.m_needs_sample_3 = False
            self.environment, self.pattern = properties["environment"], properties["pattern"]
            self.tells_rays = bool(properties.get("tells_rays", False))
            self.is_only_met = bool(properties.get("is_only_met", False))
            turn = properties["to_world"].matrix
            # numbers that kernels read: another rotation needs no new kernel
            self.rows = [[dr.opaque(mi.Float, float(turn[j, i])) for j in range(3)] for i in range(3)]

        def set_scene(self, scene: Any) -> None:
            self.environment.set_scene(scene)

        def eval(self, si: Any, active: Any = True) -> Any:
            drawn, sharp = self.environment.eval(si, active), is_sharp(mi, si)
            if self.tells_rays:
                sharp |= is_directed(mi, si)
            sharp &= active
            along = [-sum(row[k] * si.wi[k] for k in range(3)) for row in self.rows]
            direction = mi.Vector3f(*along)
            place = lamp_place(direction, -direction, (-direction, mi.Float(dr.inf)), si)
            place.dn_dv = si.dn_dv
            return dr.select(sharp, self.pattern.eval(place, sharp), drawn)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds, weight = self.environment.sample_direction(it, sample, active)
            ds.emitter = mi.EmitterPtr(self)
            if self.is_only_met:
                ds.pdf, weight = mi.Float(0.0), mi.Spectrum(0.0)
            return ds, weight

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0.0) if self.is_only_met else self.environment.pdf_direction(it, ds, active)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self.environment.eval_direction(it, ds, active)

        def bbox(self) -> Any:
            return self.environment.bbox()

        def traverse(self, callback: Any) -> None:
            for name in ("environment", "pattern"):
                callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "PatternedEnvironment"

    mi.register_emitter("patterned_environment", lambda properties: PatternedEnvironment(properties))
    mi.register_emitter("signed_environment", lambda properties: SignedEnvironment(properties))
    mi.register_emitter("tinted_environment", lambda properties: TintedEnvironment(properties))
