# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of the camera rays' first hits, without light: depth, normals, colors of surfaces, indices, cryptomattes,
AOVs.

As in Cycles, depth, position and indices come from one ray through the middle of the pixel, so that numbers of two
objects are never mixed and edges are straight; all other passes are means over the samples. Surfaces with a coverage
below the alpha threshold are transparent.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.passes import cryptomatte
from spectral_core.render.passes.joined import OF_FIRST_SAMPLE
from spectral_core.render.passes.lobe_colors import LobeColors
from spectral_core.render.passes.subjects import Subjects
from spectral_core.render.plugins.lamps.patterns import lamp_place
from spectral_core.render.plugins.numbers import channel_mean
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.render.trace.media import flight as flights
from spectral_core.render.trace.wavelengths import WavelengthPlan
from spectral_core.scene import Camera, Film
from spectral_core.scene.passes import DATA_PASSES, LOBES, Passes
from spectral_core.spectra.color import RGB_FROM_XYZ

Array = NDArray[np.float32]

MOST_SAMPLES, COLOR_SAMPLES = 64, 128
"""Most camera rays per pixel, at most as many as the picture has: for passes with edges, and for colors of lobes, which
are drawn at random.
"""
MOST_OF_LIGHT = 1024
"""Most rays of the light whose colors divide it: a share of an edge is known to 3 % or better after these."""
MOST_PASSED = 64
"""Most transparent surfaces on a ray."""
FAR = 1e10
"""Depth of the background, as Cycles writes it."""
AOV_CHANNELS = 4
"""A color and its coverage of the pixel."""


class DataPasses(LobeColors):
    """Traces the data passes of one loaded scene.

    ``unit``: the renderer's units per unit of the scene. ``light_samples``: number of samples of the light passes that
    are divided by colors, 0 for none. ``sampled``: the ``SampledVolumes`` between surfaces, None for none.
    """

    _is_middle: Any = None
    """True for the ray through the middle of the pixel."""

    def __init__(
        self,
        mitsuba: Any,
        view: tuple[Camera, Film],
        wavelengths: WavelengthPlan | None,
        wanted: Passes,
        subjects: Subjects,
        unit: float,
        light_samples: int = 0,
        sampled: Any = None,
    ) -> None:
        super().__init__(mitsuba, *view, wavelengths, keep=False)
        self._wanted, self._subjects, self._unit, self._sampled = wanted, subjects, unit, sampled
        self._light_samples = min(light_samples, MOST_OF_LIGHT)
        self._rows: dict[str, int] = {}
        names = [*wanted.data, *(name for name, _ in wanted.aovs)]
        self._width = 0
        for name in names:
            self._rows[name] = self._width
            self._width += DATA_PASSES.get(name, AOV_CHANNELS)
        self._drawn = self._width
        self._width += 1
        self._colors = [lobe for lobe in LOBES if f"{lobe} Color" in self._rows]
        self._load_white()
        self._crypto = cryptomatte.Slots(mitsuba, self._dr, wanted.levels + wanted.levels % 2)

    def trace(self, first_hit: FirstHit) -> dict[str, Array]:
        """Every requested pass (height, width, channels), row 0 at the bottom; cryptomattes as layers 00, 01, …."""
        mi, dr = self._mi, self._dr
        width, height = self.film.size
        count = width * height
        samples = COLOR_SAMPLES if self._colors else min(self.film.samples, MOST_SAMPLES)
        if self._light_samples and self._colors:  # whole rounds of the rays of the light
            samples = self._light_samples * -(-samples // self._light_samples)
        pixel = dr.arange(mi.UInt32, count)
        corner, sampler = self._lanes(pixel)
        self._sums = dr.opaque(mi.Float, 0.0, count * self._width)
        self._pixel = pixel
        kinds = self._wanted.cryptomattes
        total, period = dr.opaque(mi.UInt32, samples), dr.opaque(mi.UInt32, self._light_samples or samples)

        def body(index: Any, *slots: Any) -> Any:
            sampler.begin(index % period)
            self._is_middle = index == total
            ray, drawn = self._ray(corner, sampler)
            sampler.index = index  # a ray that comes again draws other lobes
            self._measured = lambda light: self._measure(light, drawn)
            return index + 1, *self._walk(first_hit, ray, sampler, slots)

        empty = [register for _ in kinds for register in self._crypto.empty(count)]
        # the last ray goes through the middle of the pixel, for passes of one ray
        end = total + dr.opaque(mi.UInt32, int(any(name in self._rows for name in OF_FIRST_SAMPLE)))
        _, *slots = dr.while_loop((mi.UInt32(0), *empty), lambda index, *_: index < end, body)
        dr.eval(self._sums, *slots)
        self._measured = self._is_middle = None
        sums = np.array(self._sums).reshape(count, self._width)
        pictures = self._pictures(sums.astype(np.float64), samples)
        size = self._crypto.count
        for order, kind in enumerate(kinds):
            own = slots[2 * size * order : 2 * size * (order + 1)]
            numbers = np.stack([np.array(part) for part in own[:size]], axis=1).astype(np.uint32)
            weights = np.stack([np.array(part) for part in own[size:]], axis=1) / np.float32(samples)
            found = cryptomatte.layers(numbers, weights, self._subjects.ids[kind])
            pictures |= {f"{kind}{layer:02d}": picture for layer, picture in enumerate(found)}
        return {name: np.ascontiguousarray(p.reshape(height, width, -1), np.float32) for name, p in pictures.items()}

    def _offset(self, draw: Any) -> Any:
        return self._dr.select(self._is_middle, 0.0, super()._offset(draw))

    def _walk(self, first_hit: FirstHit, ray: Any, sampler: Any, slots: Any) -> Any:
        """One camera ray, through transparent surfaces, media and volumes, to an opaque one."""
        mi, dr = self._mi, self._dr
        draws = self._picks(sampler), sampler.next_2d()
        for _, weight in draws[0]:
            self._put(self._drawn, weight, ~self._is_middle)
        bounds = dr.opaque(mi.UInt32, MOST_PASSED)
        rules = first_hit.rules
        assert rules is not None, "a scene without tables has no surfaces"
        fills = rules.media

        def body(
            origin: Any, length: Any, shares: Any, done: Any, fog: Any, layers: Any, walking: Any, *slots: Any
        ) -> Any:
            clear, reach = shares
            si, met, unseen, hole = first_hit.meet(ray, origin, length, walking)
            if self._sampled is not None:
                way = dr.select(si.is_valid(), si.t, length)
                left = self._sampled.seen_through(origin, ray.d, way, walking)
                clear, reach = clear * left, reach * left
            if fills is not None:
                piece = mi.Ray3f(ray)
                piece.o = origin
                way = dr.select(si.is_valid(), si.t, dr.inf)
                unscattered = flights.clear(fills, fog, way, piece, walking)
                clear, reach = clear * unscattered, reach * channel_mean(dr, unscattered)
                fog = fills.crossed(fog, rules.shape_number(si), si, (ray.d, ray.d), met & ~unseen)
            seen = met & ~unseen
            bsdf = first_hit.surface(si)
            passed = dr.select(seen, bsdf.eval_null_transmission(si, seen), 1.0)
            alpha = 1.0 - channel_mean(dr, passed)
            weight = channel_mean(dr, clear)
            rows = self._subjects.of_hit(rules, si, seen)
            counts = ~self._is_middle
            self._see_outputs(si, rows[1], reach, seen & ~done & counts)
            self._see_background(si, ray.d, reach, walking & ~si.is_valid() & ~done & counts)
            # as in Cycles: a whole holdout has no data but AOVs, one that is transparent in part has all but colors
            ends = seen & (self._held_out(first_hit, si, bsdf, (passed, hole), seen) > 1.0 - 1e-5)
            shows = seen & ~ends
            single = shows & ~done & (alpha >= self._wanted.alpha_threshold) & (alpha > 0.0)
            self._see_place(si, rows, reach, single)
            self._see_mist(si, shows & counts, weight * alpha)
            if self._colors:
                self._see_colors((si, bsdf), clear, draws, shows & ~hole & counts)
            named = self._see_names(rows, weight * alpha, shows & counts, list(slots))
            clear = dr.select(seen, clear * passed, clear)
            onward = met & ~ends & (dr.max(clear) > 1e-4) & (layers + 1 < bounds)
            return (
                dr.select(onward, si.spawn_ray(ray.d).o, origin),
                dr.select(onward, length - si.t, length),
                (clear, reach),
                done | single,
                fog,
                layers + 1,
                onward,
                *named,
            )

        fog = (mi.UInt32(0), mi.UInt32(0)) if fills is None else tuple(mi.UInt32(number) for number in fills.camera)
        start = (
            mi.Point3f(ray.o), mi.Float(ray.maxt), (mi.Spectrum(1.0), mi.Float(1.0)), mi.Bool(False), fog, mi.UInt32(0),
            mi.Bool(True), *slots,
        )  # fmt: skip
        return dr.while_loop(start, lambda *state: state[6], body)[7:]

    def _add(self, name: str, values: tuple[Any, ...], active: Any) -> None:
        """Add numbers to a pass of the pixel, if it is requested."""
        if name not in self._rows:
            return
        for k, value in enumerate(values):
            self._put(self._rows[name] + k, value, active)

    def _put(self, column: int, value: Any, active: Any) -> None:
        mi, dr = self._mi, self._dr
        finite = dr.select(dr.isfinite(value), value, 0.0)
        at = self._pixel * self._width + column
        dr.scatter_add(self._sums, mi.Float(finite), at, active, dr.ReduceMode.NoConflicts)

    def _see_place(self, si: Any, rows: tuple[Any, Any], weight: Any, single: Any) -> None:
        """Position, depth and indices of the surface; means count it by the share that no medium scatters."""
        mi, dr = self._mi, self._dr
        frame = self.frame
        from_eye = si.p - mi.Point3f(*(self._number(part) for part in frame.origin))
        depth = -dr.dot(from_eye, mi.Vector3f(*(self._number(part) for part in frame.back)))
        if frame.camera.panorama is not None:
            depth = dr.norm(from_eye)
        facing = dr.select(dr.dot(si.n, si.dn_du) > 0.0, si.sh_frame.n, -si.sh_frame.n)
        subjects = self._subjects
        gather = lambda values, row: dr.gather(mi.Float, values, row, single)  # noqa: E731
        uv = gather(subjects.has_uv, rows[0])
        middle, means = single & self._is_middle, single & ~self._is_middle
        self._add("Depth", (depth,), middle)
        self._add("Position", (si.p.x, si.p.y, si.p.z), middle)
        self._add("Object Index", (gather(subjects.object_index, rows[0]),), middle)
        self._add("Material Index", (gather(subjects.material_index, rows[1]),), middle)
        facing, uv = facing * weight, uv * weight
        self._add("Normal", (facing.x, facing.y, facing.z), means)
        self._add("UV", (si.uv.x * uv, si.uv.y * uv, uv), means)

    def _see_outputs(self, si: Any, material: Any, weight: Any, single: Any) -> None:
        """Values of the materials for AOVs: as in Cycles, of each surface up to the first one that is opaque enough."""
        for name, parts in self._subjects.outputs.items():
            for row, textures in parts:
                mine = single & (material == row)
                values = tuple(texture.eval_1(si, mine) * weight for texture in textures)
                self._add(name, (*values, weight), mine)

    def _see_background(self, si: Any, direction: Any, weight: Any, active: Any) -> None:
        """Values of the environment for AOVs, behind surfaces that are not opaque enough."""
        if not self._subjects.of_world:
            return
        place = lamp_place(direction, -direction, (-direction, self._mi.Float(self._dr.inf)), si)
        place.dn_dv = si.dn_dv
        for name, textures in self._subjects.of_world.items():
            values = tuple(texture.eval_1(place, active) * weight for texture in textures)
            self._add(name, (*values, weight), active)

    def _see_mist(self, si: Any, seen: Any, weight: Any) -> None:
        """Transmittance of the mist in front of the surface."""
        dr = self._dr
        if "Mist" not in self._rows:
            return
        mist = self._wanted.mist
        origin = self._mi.Point3f(*(self._number(part) for part in self.frame.origin))
        scale = self._number(1.0 / self._unit)
        from_eye = si.p - origin
        if self.frame.camera.kind == "orthographic":
            away = (
                dr.abs(dr.dot(from_eye, self._mi.Vector3f(*(self._number(part) for part in self.frame.back)))) * scale
            )
        else:
            away = dr.norm(from_eye) * scale
        # a mist of depth 0 is nowhere, as in Cycles
        share = dr.clip((away - self._number(mist.start)) * self._number(1 / mist.depth if mist.depth else 0), 0.0, 1.0)
        if mist.falloff == "QUADRATIC":
            share = share * share
        elif mist.falloff == "INVERSE_QUADRATIC":
            share = dr.sqrt(share)
        self._add("Mist", ((1.0 - share) * weight,), seen)

    def _see_names(self, rows: tuple[Any, Any], weight: Any, seen: Any, slots: list[Any]) -> list[Any]:
        """The cryptomatte registers with the names of a surface."""
        mi, dr = self._mi, self._dr
        size = 2 * self._crypto.count
        result: list[Any] = []
        for order, kind in enumerate(self._wanted.cryptomattes):
            row = rows[1] if kind == "CryptoMaterial" else rows[0]
            number = dr.gather(mi.UInt32, self._subjects.numbers[kind], row, seen)
            result += self._crypto.add(slots[size * order : size * (order + 1)], number, weight, seen)
        return result

    def _pictures(self, sums: NDArray[np.float64], samples: int) -> dict[str, NDArray[Any]]:
        """Means, in the scene's units and in linear sRGB, by name."""
        found: dict[str, NDArray[Any]] = {}
        for name, start in self._rows.items():
            part = sums[:, start : start + DATA_PASSES.get(name, AOV_CHANNELS)]
            found[name] = part if name in OF_FIRST_SAMPLE else part / samples
        drawn = sums[:, self._drawn : self._drawn + 1] / samples
        for lobe in self._colors:
            color = found[f"{lobe} Color"] / np.maximum(drawn, 1e-9)
            found[f"{lobe} Color"] = color if self.plan is None else color @ RGB_FROM_XYZ.T
        for name in ("Depth", "Position"):
            if name in found:
                found[name] = found[name] / self._unit
        if "Depth" in found:
            found["Depth"] = np.where(found["Depth"] == 0, FAR, found["Depth"])
        if "Mist" in found:
            found["Mist"] = np.clip(1.0 - found["Mist"], 0.0, 1.0)
        return found
