# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of the camera rays' first hits, without light: depth, normals, colors of surfaces, indices, cryptomattes,
AOVs.

As in Cycles, depth, position and indices come from a pixel's first sample, so that numbers of two objects are never
mixed; all other passes are means over the samples. Surfaces with a coverage below the alpha threshold are transparent.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene.paint import white_light
from spectral_core.render.passes import cryptomatte
from spectral_core.render.passes.joined import OF_FIRST_SAMPLE
from spectral_core.render.passes.subjects import Subjects
from spectral_core.render.plugins.closures.subsurface import DIVES
from spectral_core.render.plugins.numbers import channel_mean, table
from spectral_core.render.trace.accumulate import Accumulator
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.render.trace.lobes import drawn_parts
from spectral_core.render.trace.path_sampler import hashed_seed, path_sampler_class
from spectral_core.render.trace.wavelengths import WavelengthPlan
from spectral_core.scene import Camera, Film
from spectral_core.scene.passes import DATA_PASSES, LOBES, Passes
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.spectrum import FIRST_NM, WAVELENGTHS_NM

Array = NDArray[np.float32]

MOST_SAMPLES, COLOR_SAMPLES = 64, 128
"""Most camera rays per pixel, at most as many as the picture has: for passes with edges, and for colors of lobes, which
are drawn at random.
"""
MOST_PASSED = 64
"""Most transparent surfaces on a ray."""
FAR = 1e10
"""Depth of the background, as Cycles writes it."""
AOV_CHANNELS = 4
"""A color and its coverage of the pixel."""
RAREST = 1e-4
"""Least probability of a lobe that is drawn as often as others: a pane of glass reflects 1 % of light."""


class DataPasses(Accumulator):
    """Traces the data passes of one loaded scene. ``unit``: the renderer's units per unit of the scene."""

    _measured: Any = None

    def __init__(
        self,
        mitsuba: Any,
        view: tuple[Camera, Film],
        wavelengths: WavelengthPlan | None,
        wanted: Passes,
        subjects: Subjects,
        unit: float,
    ) -> None:
        super().__init__(mitsuba, *view, wavelengths, keep=False)
        self._wanted, self._subjects, self._unit = wanted, subjects, unit
        self._rows: dict[str, int] = {}
        names = [*wanted.data, *(name for name, _ in wanted.aovs)]
        self._width = 0
        for name in names:
            self._rows[name] = self._width
            self._width += DATA_PASSES.get(name, AOV_CHANNELS)
        self._drawn = self._width
        self._width += 1
        self._colors = [lobe for lobe in LOBES if f"{lobe} Color" in self._rows]
        if wavelengths is not None:
            self._white = table(mitsuba.Float, white_light().at(WAVELENGTHS_NM))
        self._crypto = cryptomatte.Slots(mitsuba, self._dr, wanted.levels + wanted.levels % 2)

    def trace(self, first_hit: FirstHit) -> dict[str, Array]:
        """Every requested pass (height, width, channels), row 0 at the bottom; cryptomattes as layers 00, 01, …."""
        mi, dr = self._mi, self._dr
        width, height = self.film.size
        count = width * height
        samples = COLOR_SAMPLES if self._colors else min(self.film.samples, MOST_SAMPLES)
        pixel = dr.arange(mi.UInt32, count)
        left, bottom = map(self._number, self.film.crop[:2] if self.film.crop else (0, 0))
        columns = dr.opaque(mi.UInt32, width)
        corner = mi.Point2f(mi.Float(pixel % columns) + left, mi.Float(pixel // columns) + bottom)
        seed = dr.opaque(mi.UInt32, hashed_seed(self.film.seed))
        sampler = path_sampler_class(mi.variant())(mi.sample_tea_32(pixel, seed, 6)[0])
        self._sums = dr.opaque(mi.Float, 0.0, count * self._width)
        self._pixel = pixel
        kinds = self._wanted.cryptomattes
        total = dr.opaque(mi.UInt32, samples)

        def body(index: Any, *slots: Any) -> Any:
            sampler.begin(index)
            ray, drawn = self._ray(corner, sampler)
            self._measured = lambda light: self._measure(light, drawn)
            return index + 1, *self._walk(first_hit, first_hit.past_hidden(ray), sampler, index == 0, slots)

        empty = [register for _ in kinds for register in self._crypto.empty(count)]
        _, *slots = dr.while_loop((mi.UInt32(0), *empty), lambda index, *_: index < total, body)
        dr.eval(self._sums, *slots)
        self._measured = None
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

    def _walk(self, first_hit: FirstHit, ray: Any, sampler: Any, is_first: Any, slots: Any) -> Any:
        """One camera ray, through transparent surfaces, to an opaque one."""
        mi, dr = self._mi, self._dr
        pick, direction = sampler.next_1d(), sampler.next_2d()
        pick, weight = self._spread(pick, sampler.index)
        self._put(self._drawn, weight, mi.Bool(True))
        bounds = dr.opaque(mi.UInt32, MOST_PASSED)

        def body(origin: Any, length: Any, clear: Any, done: Any, layers: Any, walking: Any, *slots: Any) -> Any:
            si, met, unseen, hole = first_hit.meet(ray, origin, length, walking)
            seen = met & ~unseen & ~hole
            bsdf = first_hit.surface(si)
            passed = dr.select(seen, bsdf.eval_null_transmission(si, seen), 1.0)
            alpha = 1.0 - channel_mean(dr, passed)
            single = seen & ~done & (alpha >= self._wanted.alpha_threshold) & (alpha > 0.0)
            rows = self._subjects.of_hit(first_hit.rules, si, seen)
            self._see_place(si, rows, single, is_first)
            self._see_outputs(si, rows[1], single)
            self._see_mist(si, seen, channel_mean(dr, clear) * alpha)
            if self._colors:
                self._see_colors(si, bsdf, clear * weight, (pick, direction), seen)
            named = self._see_names(rows, channel_mean(dr, clear) * alpha, seen, list(slots))
            clear = dr.select(seen, clear * passed, clear)
            onward = met & ~hole & (dr.max(clear) > 1e-4) & (layers + 1 < bounds)
            return (
                dr.select(onward, si.spawn_ray(ray.d).o, origin),
                dr.select(onward, length - si.t, length),
                clear,
                done | single,
                layers + 1,
                onward,
                *named,
            )

        start = (
            mi.Point3f(ray.o), mi.Float(ray.maxt), mi.Spectrum(1.0), mi.Bool(False), mi.UInt32(0), mi.Bool(True), *slots
        )  # fmt: skip
        return dr.while_loop(start, lambda *state: state[5], body)[6:]

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

    def _spread(self, pick: Any, index: Any) -> tuple[Any, Any]:
        """A number that draws a lobe, and its weight: every other one is distributed evenly over orders of magnitude.

        Lobes are drawn by their share of [0, 1), reflecting lobes from 0 on.
        """
        mi, dr = self._mi, self._dr
        spread = float(np.log(1.0 / RAREST))
        small = dr.exp(-spread * (1.0 - pick))
        pick = dr.select((index & 1) == 1, small, pick)
        density = 0.5 + dr.select(pick >= RAREST, 0.5 / (spread * dr.maximum(pick, RAREST)), 0.0)
        return dr.minimum(pick, 1.0 - 1e-6), mi.Float(dr.rcp(density))

    def _see_place(self, si: Any, rows: tuple[Any, Any], single: Any, is_first: Any) -> None:
        """Position, depth and indices of the surface."""
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
        first = single & is_first
        self._add("Depth", (depth,), first)
        self._add("Position", (si.p.x, si.p.y, si.p.z), first)
        self._add("Object Index", (gather(subjects.object_index, rows[0]),), first)
        self._add("Material Index", (gather(subjects.material_index, rows[1]),), first)
        self._add("Normal", (facing.x, facing.y, facing.z), single)
        self._add("UV", (si.uv.x * uv, si.uv.y * uv, uv), single)
        self._add("Denoising Depth", (depth,), single)
        self._add("Denoising Normal", (facing.x, facing.y, facing.z), single)

    def _see_outputs(self, si: Any, material: Any, single: Any) -> None:
        """Values of the materials for AOVs."""
        for name, parts in self._subjects.outputs.items():
            for row, textures in parts:
                mine = single & (material == row)
                values = tuple(texture.eval_1(si, mine) for texture in textures)
                self._add(name, (*values, self._mi.Float(1.0)), mine)

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
        share = dr.clip((away - self._number(mist.start)) / self._number(max(mist.depth, 1e-9)), 0.0, 1.0)
        if mist.falloff == "QUADRATIC":
            share = share * share
        elif mist.falloff == "INVERSE_QUADRATIC":
            share = dr.sqrt(share)
        self._add("Mist", ((1.0 - share) * weight,), seen)

    def _see_colors(self, si: Any, bsdf: Any, clear: Any, draws: tuple[Any, Any], seen: Any) -> None:
        """Colors of the lobes, each for a direction that the surface draws."""
        mi, dr = self._mi, self._dr
        bs, weight = bsdf.sample(mi.BSDFContext(), si, *draws, seen)
        straight = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
        dives = (bs.sampled_type & DIVES) != 0
        usable = seen & ~straight & dr.all(dr.isfinite(weight))
        diffuse, glossy = drawn_parts(mi, dr, si, bsdf, bs, usable & ~dives)
        weight = dr.select(dives, weight * bs.pdf, weight)
        diffuse, glossy = dr.select(dives, mi.Spectrum(1.0), diffuse), dr.select(dives, 0.0, glossy)
        lit = dr.select(usable, clear * weight * self._white_at(si), 0.0)
        shares = dict(zip(LOBES, (diffuse, glossy, 1.0 - diffuse - glossy), strict=True))
        for lobe in self._colors:
            color = self._measured(lit * shares[lobe])
            self._add(f"{lobe} Color", (color.x, color.y, color.z), usable)

    def _white_at(self, si: Any) -> Any:
        """The light under which a white surface appears white: radiance per nm, or 1."""
        mi, dr = self._mi, self._dr
        if self.plan is None:
            return mi.Spectrum(1.0)
        values = []
        for k in range(4):
            place = dr.clip(si.wavelengths[k] - FIRST_NM, 0.0, WAVELENGTHS_NM.size - 1.001)
            low = mi.UInt32(place)
            ends = [dr.gather(mi.Float, self._white, low + step) for step in (0, 1)]
            values.append(dr.lerp(*ends, place - mi.Float(low)))
        return mi.Spectrum(*values)

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
        for name in ("Depth", "Denoising Depth", "Position"):
            if name in found:
                found[name] = found[name] / self._unit
        if "Depth" in found:
            found["Depth"] = np.where(found["Depth"] == 0, FAR, found["Depth"])
        if "Mist" in found:
            found["Mist"] = np.clip(1.0 - found["Mist"], 0.0, 1.0)
        if "Denoising Normal" in found:
            axes = np.stack([self.frame.right, self.frame.up, -self.frame.back], axis=1)
            found["Denoising Normal"] = found["Denoising Normal"] @ axes
        if "Denoising Albedo" in found:
            found["Denoising Albedo"] = np.clip(sum(found[f"{lobe} Color"] for lobe in LOBES), 0.0, 1.0)
        return found
