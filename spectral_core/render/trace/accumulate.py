# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums of the picture, on the just-in-time variants: one lane per pixel, a loop over its samples in the kernel.

Every random number is a scrambled Sobol point of its pixel, sample and dimension of the path, and the sums persist
between passes: pixels do not depend on the split of samples into passes.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lens.aperture import lens_point
from spectral_core.render.lens.camera_rays import camera_frame, rays
from spectral_core.render.lens.panorama import DrJitMath
from spectral_core.render.lens.pixel_filter import OFFSET_TABLE_SIZE, filter_offsets
from spectral_core.render.plugins.numbers import channel_mean, table
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.render.trace.measure.spectral_measure import Drawn, SpectralMeasure
from spectral_core.render.trace.measure.tile import Tile
from spectral_core.render.trace.path.sampler import hashed_seed, path_sampler_class
from spectral_core.render.trace.wavelengths import WavelengthPlan
from spectral_core.scene import Camera, Film
from spectral_core.spectra.color import RGB_FROM_XYZ

LARGEST_SAMPLE = 1e33
"""Larger sums would overflow in 32 bits after some 100,000 samples."""
TILE_PIXELS = 1 << 21
"""Pixels per kernel launch: recording more launches takes longer, and a longer launch reacts late to a cancel."""


class Accumulator:
    """Running sums of a picture, one object per frame and light group; ``add`` traces, ``mean`` reads.

    ``keep`` False allocates no sums: for tracers of chosen pixels.
    """

    keeps_light = True
    """True if shares of the light are summed, provided that the integrator separates them."""

    def __init__(
        self, mitsuba: Any, camera: Camera, film: Film, wavelengths: WavelengthPlan | None, *, keep: bool = True
    ) -> None:
        import drjit

        self._mi, self._dr = mitsuba, drjit
        self.film, self.frame, self._sees_partly = film, camera_frame(camera, film), camera.panorama is not None
        self._offsets = table(mitsuba.Float, filter_offsets(film))
        self.plan = wavelengths
        self._measuring = None if wavelengths is None else SpectralMeasure(mitsuba, wavelengths)
        width, height = film.size
        pixels = width * height if keep else 0
        self.tiles = [
            self._new_tile(first, min(TILE_PIXELS, pixels - first)) for first in range(0, pixels, TILE_PIXELS)
        ]

    @property
    def samples(self) -> int:
        """Samples that every pixel has so far."""
        return min((tile.samples for tile in self.tiles), default=0)

    @property
    def band_count(self) -> int:
        """Number of spectral channels beside the picture."""
        return 0 if self.plan is None else len(self.plan.responses) - 3

    def _new_tile(self, first: int, count: int) -> Tile:
        mi, dr = self._mi, self._dr
        # opaque: zeros that are known to the compiler would give the first pass a kernel of its own
        tile = Tile(first, count)
        lanes = tile.lanes
        tile.bands = dr.opaque(mi.Float, 0.0, lanes * self.band_count) if self.band_count else None
        tile.sums = mi.Color3f(*(dr.opaque(mi.Float, 0.0, lanes) for _ in range(3)))
        tile.covered, tile.lost = dr.opaque(mi.Float, 0.0, lanes), dr.opaque(mi.UInt32, 0, lanes)
        return tile

    @property
    def lost(self) -> int:
        """Samples so far whose radiance was not a finite number."""
        return sum(int(tile.of_pixels(tile.lost).sum()) for tile in self.tiles)

    def add(self, first_hit: FirstHit, integrator: Any, samples: int) -> Iterator[float]:
        """Trace ``samples`` more per pixel; yields the completed share of the pass after each tile."""
        for done, tile in enumerate(self.tiles, 1):
            self._trace(first_hit, integrator, tile, samples)
            tile.samples += samples
            yield done / len(self.tiles)

    def _trace(self, first_hit: FirstHit, integrator: Any, tile: Tile, samples: int) -> None:
        mi, dr = self._mi, self._dr
        pixel = self._pixels(tile)
        corner, sampler = self._lanes(pixel)
        first, total = self._span(tile, samples)
        bands, lane = tile.bands, dr.arange(mi.UInt32, tile.lanes)
        tells_apart = getattr(integrator, "book_into", None) if self.keeps_light else None
        if tells_apart is not None and tile.light is None:
            tile.light = dr.opaque(mi.Float, 0.0, tile.lanes * integrator.rows * 3)

        def sample(index: Any, sums: Any, covered: Any, lost: Any) -> Any:
            sampler.begin(index)
            ray, drawn = self._ray(corner, sampler)
            if tells_apart is not None:
                tells_apart(tile.light, lane, lambda light, later: self._measure(light, drawn, later))
            light, coverage, finite = self._follow(first_hit, integrator, sampler, ray)
            color, finite, measured = self._checked(light, drawn, finite)
            radiance = dr.select(measured, light[0], 0.0)
            if bands is not None and self._measuring is not None and drawn is not None:
                self._measuring.scatter_bands(bands, lane, radiance, drawn)
            return index + 1, sums + color, covered + coverage, lost + dr.select(finite, mi.UInt32(0), mi.UInt32(1))

        def step(index: Any, sums: Any, covered: Any, lost: Any, path: Any, sampler: Any) -> Any:
            ray, sampler, path = self._begun(integrator, corner, (index, sampler, path))
            path, sampler = integrator.step(first_hit.scene, path, sampler)
            ends = ~path.active
            light, finite = self._finite((path.light, None), mi.Bool(True))
            color, finite, _ = self._checked(light, None, finite)
            looks = ends & (ray.maxt > 0.0)  # outside a fisheye's circle the picture is empty
            sums, covered = sums + dr.select(looks, color, 0.0), covered + dr.select(looks, mi.Float(1.0), 0.0)
            one = dr.select(ends, mi.UInt32(1), 0)
            return index + one, sums, covered, lost + dr.select(finite, mi.UInt32(0), one), path, sampler

        # A lane whose path has ended starts the next one with its next ray. In nested loops over samples and paths
        # it would wait for the longest path of its packet. Spectral transport does not do so: to draw and to weight
        # wavelengths for each ray would cost more than is gained.
        restarts = getattr(integrator, "restarts", False) and self._measuring is None
        restarts = restarts and not first_hit.looks_through
        start = (first, tile.sums, tile.covered, tile.lost, *((integrator.State(), sampler) if restarts else ()))
        labels = ("index", "sums", "covered", "lost", *(("path", "sampler") if restarts else ()))
        body = step if restarts else sample
        _, tile.sums, tile.covered, tile.lost, *_ = dr.while_loop(
            start, lambda index, *_: index < total, body, labels=labels
        )
        if restarts:
            integrator.release()
        if tells_apart is not None:
            tells_apart(None, None, None)
        dr.eval(tile.sums, tile.covered, tile.lost, bands, tile.light)
        dr.sync_thread()

    def _begun(self, integrator: Any, corner: Any, state: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
        """The camera ray of a lane's sample (its index, sampler, path), and the sampler and the path: those of a new
        path where the last one has ended.
        """
        mi, dr, (index, sampler, path) = self._mi, self._dr, state
        first = sampler.clone()
        first.begin(index)
        ray, _ = self._ray(corner, first)
        sampler.index = dr.select(path.active, sampler.index, first.index)
        sampler.dimension = dr.select(path.active, sampler.dimension, first.dimension)
        return ray, sampler, dr.select(path.active, path, integrator.begin(mi.Ray3f(ray), mi.Bool(True)))

    def _finite(self, light: tuple[Any, Any], seen: Any) -> tuple[tuple[Any, Any], Any]:
        """Radiance and its later parts, with 0 in place of numbers that are not finite, and whether all were."""
        dr, (radiance, later) = self._dr, light
        is_finite = seen & dr.isfinite(radiance)
        if later is not None:
            later = tuple(dr.select(is_finite & dr.isfinite(part), part, 0.0) for part in later)
        return (dr.select(is_finite, radiance, 0.0), later), dr.all(dr.isfinite(radiance)) | ~seen

    def _checked(self, light: tuple[Any, Any], drawn: Drawn | None, finite: Any) -> tuple[Any, Any, Any]:
        """Color of a sample, whether it counts as finite, and whether it could be measured: a finite radiance may
        overflow, and then counts as lost too.
        """
        dr, color = self._dr, self._measure(light[0], drawn, light[1])
        measured = dr.all(dr.abs(color) < LARGEST_SAMPLE)
        return dr.select(measured, color, 0.0), finite & measured, measured

    def _lanes(self, pixel: Any) -> tuple[Any, Any]:
        """The lower left corner of each lane's pixel on the film, and the lane's random numbers."""
        mi, dr = self._mi, self._dr
        left, bottom = map(self._number, self.film.crop[:2] if self.film.crop else (0, 0))
        width = dr.opaque(mi.UInt32, self.film.size[0])
        corner = mi.Point2f(mi.Float(pixel % width) + left, mi.Float(pixel // width) + bottom)
        return corner, path_sampler_class(mi.variant())(mi.sample_tea_32(pixel, self._seed(), 6)[0])

    def _seed(self) -> Any:  # of all lanes or of each
        return self._dr.opaque(self._mi.UInt32, hashed_seed(self.film.seed))

    def _pixels(self, tile: Tile) -> Any:
        """Number of each lane's pixel."""
        return self._dr.arange(self._mi.UInt32, tile.lanes) + self._dr.opaque(self._mi.UInt32, tile.first)

    def _span(self, tile: Tile, samples: int) -> tuple[Any, Any]:
        """First sample of a tile's pass, and the one after its last."""
        number = lambda value: self._dr.opaque(self._mi.UInt32, value)  # noqa: E731
        return number(tile.samples), number(tile.samples + samples)

    def _follow(self, first_hit: FirstHit, integrator: Any, sampler: Any, ray: Any) -> tuple[Any, Any, Any]:
        """Radiance along a camera ray with its parts after two diffuse reflections and after more (None in RGB
        transport), its coverage of the pixel, and True if it was a finite number.
        """
        mi, dr, looks = self._mi, self._dr, ray.maxt > 0.0
        passed, behind, sees = mi.Spectrum(0.0), mi.Spectrum(0.0), mi.Bool(False)
        sampled = getattr(integrator, "sampled", None)
        if sampled is not None:
            sampled.begin(sampler)
        if first_hit.looks_through:
            passed, behind, sees = first_hit.straight_through(ray, sampled)
        later = None
        # where nothing covers the picture, there may still be a lamp that the camera sees, a surface, a volume or a
        # medium that emits light and takes none, or a pass of the environment
        fills = None if first_hit.rules is None else first_hit.rules.media
        shows = first_hit.shows_lamps or sampled is not None or (fills is not None and fills.emits)
        meets = shows or getattr(integrator, "sums", None) is not None
        seen = mi.Bool(True) if meets else sees | (dr.min(passed) < 1.0)
        if self._sees_partly:  # outside a fisheye's circle the picture and its passes are empty
            seen &= looks
        radiance, _, extra = integrator.sample(first_hit.scene, sampler, ray, None, seen)
        if sampled is not None:
            sampled.release()
        if getattr(integrator, "tells_reflections", False):
            extra, parts = extra[:-8], extra[-8:]
            later = mi.Spectrum(*parts[:4]), mi.Spectrum(*parts[4:])
        if extra:
            passed += dr.select(seen & dr.isfinite(extra[0]), extra[0], 0.0)  # the share behind glass
        (radiance, later), finite = self._finite((radiance, later), seen)
        radiance -= dr.select(seen, behind, 0.0)  # radiance holds the environment behind: its mean is subtracted
        covered = 1.0 - channel_mean(dr, passed)
        if self._sees_partly:
            radiance, covered = dr.select(looks, radiance, 0.0), dr.select(looks, covered, 0.0)
        return (radiance, later), covered, finite

    def _ray(self, corner: Any, sampler: Any) -> tuple[Any, Drawn | None]:
        """Camera ray of a sample, and for spectral transport its wavelengths."""
        mi, dr = self._mi, self._dr
        place, aperture = sampler.next_2d(), sampler.next_2d()
        offset = mi.Vector2f(self._offset(place.x), self._offset(place.y))
        picture = (corner + 0.5 + offset) / mi.Vector2f(self._number(self.film.width), self._number(self.film.height))
        math = DrJitMath(dr)
        lens = lens_point(mi, self.frame.camera.aperture, aperture, math, self._number)
        origin, direction, length = rays(self.frame, picture, lens, mi.Vector3f, self._number, math)
        ray = dr.zeros(mi.RayDifferential3f)
        ray.o, ray.d, ray.maxt = mi.Point3f(origin), direction, length
        ray.has_differentials = False
        return ray, self._draw_wavelengths(ray, sampler)

    def _draw_wavelengths(self, ray: Any, sampler: Any) -> Drawn | None:
        """Give a ray its wavelengths; nothing in RGB transport."""
        if self._measuring is None:
            sampler.next_1d()  # the paths of RGB transport then have the random numbers of spectral transport
            return None
        ray.wavelengths, drawn = self._measuring.draw(sampler)
        return drawn

    def _number(self, value: float) -> Any:
        """A number that the kernel reads from memory: another frame then needs no new kernel."""
        return self._dr.opaque(self._mi.Float, float(value))

    def _offset(self, draw: Any) -> Any:
        mi, dr = self._mi, self._dr
        scaled = draw * OFFSET_TABLE_SIZE
        index = dr.minimum(mi.UInt32(scaled), OFFSET_TABLE_SIZE - 1)
        low, high = dr.gather(mi.Float, self._offsets, index), dr.gather(mi.Float, self._offsets, index + 1)
        return dr.lerp(low, high, scaled - mi.Float(index))

    def _measure(self, radiance: Any, drawn: Drawn | None, later: Any = None) -> Any:
        """Linear sRGB of one sample in RGB transport, XYZ in spectral transport."""
        if self._measuring is None or drawn is None:
            return self._mi.Color3f(radiance)
        return self._measuring.color(radiance, drawn, later)

    def picture(self) -> NDArray[np.float32]:
        """Mean so far: (height, width, 4) linear sRGB and coverage, row 0 at the bottom; zeros before any sample."""
        width, height = self.film.size
        pixels = np.empty((width * height, 4), np.float32)
        for tile in self.tiles:
            part = slice(tile.first, tile.first + tile.count)
            color = tile.mean(tile.sums).T
            pixels[part, :3] = color if self.plan is None else color @ RGB_FROM_XYZ.T
            # as in Cycles: sums of holdouts, and clear surfaces brighter than 1, let more than all through
            pixels[part, 3] = np.maximum(tile.mean(tile.covered), 0.0)
        pixels[:, :3] *= self.film.exposure
        return pixels.reshape(height, width, 4)

    def band_picture(self) -> NDArray[np.float32]:
        """Mean so far of the spectral channels: (height, width, n_bands), row 0 at the bottom, without exposure."""
        width, height = self.film.size
        parts = [tile.mean(tile.bands).reshape(tile.count, -1) for tile in self.tiles]
        return np.concatenate(parts).astype(np.float32).reshape(height, width, -1)
