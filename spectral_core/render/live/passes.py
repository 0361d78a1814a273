# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a view in interleaved passes: a coarse grid of pixels, then the pixels between, then more samples.

One launch traces one pixel of each block of ``stride`` × ``stride``. The first launch is a small picture of the whole
view; all pixels of a block together are one sample of the full picture. A launch is recorded once (``dr.freeze``) and
replayed with other numbers; if recording fails, every launch is traced anew and is slower.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from spectral_core.render.job import Loaded
from spectral_core.render.lens.aperture import FEWEST_BLADES, polygon_point
from spectral_core.render.lens.camera_rays import across_lens
from spectral_core.render.lens.panorama import DrJitMath, direction_by
from spectral_core.render.live.held import held, lay_open
from spectral_core.render.live.in_place.transplant import transplant
from spectral_core.render.live.view import NUMBERS, PLAIN_NUMBERS, Viewpoint
from spectral_core.render.trace.accumulate import LARGEST_SAMPLE, Accumulator
from spectral_core.render.trace.guides import first_seen, guide_wavelengths
from spectral_core.render.trace.measure.spectral_measure import Drawn, SpectralMeasure
from spectral_core.render.trace.path.sampler import path_sampler_class
from spectral_core.render.trace.wavelengths import WavelengthPlan
from spectral_core.scene import Camera, Film
from spectral_core.scene.camera import PANORAMAS


def block_order(stride: int) -> list[tuple[int, int]]:
    """Offsets in a block in the order of tracing: every prefix of 1, 4, 16, … offsets is a regular grid."""
    order = [(0, 0)]
    step = stride
    while step > 1:
        half = step // 2
        order += [(x + dx, y + dy) for dx, dy in ((half, half), (half, 0), (0, half)) for x, y in list(order)]
        step = half
    return order


@contextmanager
def _no_collection() -> Iterator[None]:
    """Keep garbage until after a launch: a scene of Mitsuba that is freed while one is recorded ends the process."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


class Launcher(Accumulator):
    """Traces launches of one loaded scene; all of its views share the recording."""

    def __init__(
        self, loaded: Loaded, film: Film, in_units: Callable[[Viewpoint], Viewpoint], *, has_guides: bool = True
    ) -> None:
        import drjit

        self.in_units = in_units
        """From a viewpoint to the same in the loaded scene."""
        self.has_guides = has_guides
        """False if volumes or media are in front of the surfaces, whose albedo then guides no denoiser."""

        sampling = replace(film, width=1, height=1, crop=None)
        super().__init__(loaded.mitsuba, Camera(world_from_camera=np.eye(4)), sampling, loaded.wavelengths)
        self._loaded = loaded
        self._inputs: Any = None
        self._camera: Any = None
        self._frame: Any = None
        self._freeze = drjit.freeze
        self._frozen: dict[str, Any] = {}
        self._kind, self._is_guiding = "", False
        self.is_recorded = True
        """True if launches are recorded and replayed, which saves most of their time."""

    @property
    def recordings(self) -> int:
        """Number of recordings so far."""
        return sum(int(frozen.n_recordings) for frozen in self._frozen.values())

    def draw_by(self, plan: WavelengthPlan) -> None:
        """Draw the wavelengths of another plan; a change of the scene that is followed by ``refresh``."""
        made = SpectralMeasure(self._mi, plan)
        if not transplant(self._measuring, made, self._mi):  # it has another number of cells
            self._measuring = made
        self.plan = plan

    def refresh(self) -> None:
        """Collect the arrays of the scene's objects again; call it after each change of the scene."""
        mi, parts = self._mi, self._loaded.scene.parts
        # made here: an array made within a recording would end it, and one made after it would need another
        placements = parts.context.tables.buffer()
        lay_open(parts.context.made, mi)
        plugins = [*parts.context.made, self._loaded.first_hit.background, self._loaded.scene.rules.camera_world]
        plugins = [plugin for plugin in plugins if isinstance(plugin, mi.Object)]
        own = [self._offsets, self._measuring, [placements]]
        ours = held([own, self._loaded.first_hit.rules, vars(self._loaded.integrator)], mi)
        self._inputs = (ours, plugins, self._loaded.scene.scene, self._loaded.integrator)

    def trace(self, camera: Any, numbers: Any, lane: Any, sums: tuple[Any, Any], kind: str = "") -> tuple[Any, Any]:
        """Sums (color, coverage) after one more launch over the pixels ``lane`` of a grid.

        ``camera``, ``kind``: ``Viewpoint.numbers`` and its kind, by which launches are recorded; ``numbers``: columns
        of the grid, its step and its offset in x and y in pixels, first and last sample, seed, width and height of the
        picture, then ``MOST_PASSED``.
        """
        return self._replayed(self._launch, kind, camera, numbers, lane, sums)

    def guide(self, camera: Any, numbers: Any, lane: Any, sums: tuple[Any, Any], kind: str = "") -> tuple[Any, Any]:
        """Sums (albedo, normal) of the first visible surfaces, like ``trace``."""
        self._is_guiding = True
        try:
            return self._replayed(self._launch_guides, f"guides {kind}", camera, numbers, lane, sums)
        finally:
            self._is_guiding = False

    def _replayed(
        self, plain: Callable[..., Any], name: str, camera: Any, numbers: Any, lane: Any, sums: tuple[Any, Any]
    ) -> tuple[Any, Any]:
        """The result of a launch that is recorded under a name."""
        if self._inputs is None:
            self.refresh()
        self._kind = name.removeprefix("guides ") if self._is_guiding else name
        self._sees_partly = bool(self._kind)
        if name not in self._frozen:
            self._frozen[name] = self._freeze(plain)
        launch = self._frozen[name] if self.is_recorded else plain
        try:
            with _no_collection():
                result = launch(self._inputs, camera, numbers, lane, sums)
        except RuntimeError as error:
            if not self.is_recorded:
                raise
            print(f"live view: launches are not recorded; Dr.Jit reports: {error}")
            self.is_recorded = False
            with _no_collection():
                result = plain(self._inputs, camera, numbers, lane, sums)
        finally:
            self._camera = self._frame = None
        return result

    def _launch(self, inputs: Any, camera: Any, numbers: Any, lane: Any, sums: tuple[Any, Any]) -> tuple[Any, Any]:
        dr = self._dr
        corner, sampler, first, total, _ = self._begin(camera, numbers, lane)
        first_hit, integrator = self._loaded.first_hit, self._loaded.integrator

        def body(index: Any, color: Any, covered: Any) -> Any:
            sampler.begin(index)
            ray, drawn = self._ray(corner, sampler)
            (radiance, later), coverage, _ = self._follow(first_hit, integrator, sampler, ray)
            measured = self._measure(radiance, drawn, later)
            measured = dr.select(dr.all(dr.abs(measured) < LARGEST_SAMPLE), measured, 0.0)
            return index + 1, color + measured, covered + coverage

        _, color, covered = dr.while_loop(
            (first, *sums), lambda index, *_: index < total, body, labels=("index", "color", "covered")
        )
        return color, covered

    def _launch_guides(
        self, inputs: Any, camera: Any, numbers: Any, lane: Any, sums: tuple[Any, Any]
    ) -> tuple[Any, Any]:
        corner, sampler, first, total, most = self._begin(camera, numbers, lane)
        first_hit = self._loaded.first_hit

        def body(index: Any, albedo: Any, normal: Any) -> Any:
            sampler.begin(index)
            ray, _ = self._ray(corner, sampler)
            color, direction = first_seen(first_hit, ray, sampler, most)
            return index + 1, albedo + color, normal + direction

        _, albedo, normal = self._dr.while_loop(
            (first, *sums), lambda index, *_: index < total, body, labels=("index", "albedo", "normal")
        )
        return albedo, normal

    def _begin(self, camera: Any, numbers: Any, lane: Any) -> tuple[Any, ...]:
        """Corner of the pixel of each lane, its sampler, its first and last sample, and ``MOST_PASSED``."""
        mi, dr = self._mi, self._dr
        columns, stride, left, bottom, first, total, seed, width, height, most = (
            dr.gather(mi.UInt32, numbers, mi.UInt32(k)) for k in range(10)
        )
        # lanes past the end of the last packet read 0, and a division by 0 ends the process
        columns = dr.maximum(columns, 1)
        x, y = (lane % columns) * stride + left, (lane // columns) * stride + bottom
        self._camera, self._frame = camera, (mi.Float(width), mi.Float(height))
        sampler = path_sampler_class(mi.variant())(mi.sample_tea_32(y * width + x, seed, 6)[0])
        return mi.Point2f(mi.Float(x), mi.Float(y)), sampler, first, total, most

    def _draw_wavelengths(self, ray: Any, sampler: Any) -> Drawn | None:
        if not self._is_guiding:
            return super()._draw_wavelengths(ray, sampler)
        if self.plan is not None:
            ray.wavelengths = guide_wavelengths(self._mi)
        return None

    def _ray(self, corner: Any, sampler: Any) -> tuple[Any, Drawn | None]:
        """Ray of a sample through the view's window; the kernel reads all of its numbers from memory."""
        mi, dr = self._mi, self._dr
        place, aperture = sampler.next_2d(), sampler.next_2d()
        n = [dr.gather(mi.Float, self._camera, mi.UInt32(k)) for k in range(NUMBERS)]
        offset = mi.Vector2f(self._offset(place.x), self._offset(place.y))
        x = dr.lerp(n[12], n[14], (corner.x + 0.5 + offset.x) / self._frame[0])
        y = dr.lerp(n[13], n[15], (corner.y + 0.5 + offset.y) / self._frame[1])
        start, toward, length = (self._panoramic if self._kind else self._flat)(n, (x, y), self._lens(n, aperture))
        origin, right, up, back = (mi.Vector3f(*n[k : k + 3]) for k in (0, 3, 6, 9))
        ray = dr.zeros(mi.RayDifferential3f)
        ray.o = mi.Point3f(origin + right * start[0] + up * start[1] + back * start[2])
        ray.d = right * toward[0] + up * toward[1] + back * toward[2]
        ray.maxt = length
        ray.has_differentials = False
        return ray, self._draw_wavelengths(ray, sampler)

    def _lens(self, n: list[Any], draw: Any) -> Any:
        """A point of the lens, in world units."""
        mi, dr = self._mi, self._dr
        blades = dr.maximum(n[21], FEWEST_BLADES)
        polygon = mi.Point2f(*polygon_point(blades, n[22], (draw.x, draw.y), DrJitMath(dr)))
        disk = mi.warp.square_to_uniform_disk_concentric(draw)
        point = dr.select(n[21] < FEWEST_BLADES - 0.5, disk, polygon)
        return mi.Point2f(point.x / n[23], point.y) * n[19]

    def _flat(self, n: list[Any], picture: Any, lens: Any) -> tuple[Any, Any, Any]:
        """Start, direction (components to the right, up and back) and length of a ray with or without perspective."""
        dr = self._dr
        is_perspective, near, length, focus = n[16] > 0.5, n[17], n[18], n[20]
        toward_x = dr.select(is_perspective, picture[0], 0.0) - lens.x / focus
        toward_y = dr.select(is_perspective, picture[1], 0.0) - lens.y / focus
        start_x = dr.select(is_perspective, 0.0, picture[0]) + lens.x + near * toward_x
        start_y = dr.select(is_perspective, 0.0, picture[1]) + lens.y + near * toward_y
        per_depth = dr.sqrt(1.0 + toward_x * toward_x + toward_y * toward_y)
        direction = (toward_x / per_depth, toward_y / per_depth, -1.0 / per_depth)
        return (start_x, start_y, -near), direction, per_depth * length

    def _panoramic(self, n: list[Any], picture: Any, lens: Any) -> tuple[Any, Any, Any]:
        """The same of a panorama; a ray of length 0 looks nowhere."""
        dr = self._dr
        math = DrJitMath(dr)
        numbers = n[PLAIN_NUMBERS:][: PANORAMAS[self._kind]]
        toward, is_seen = direction_by(self._kind, numbers, picture, math)
        start, toward = across_lens(toward, (lens.x, lens.y), n[20], math)
        begin = tuple(offset + n[17] * part for offset, part in zip(start, toward, strict=True))
        return begin, toward, dr.select(is_seen, n[18], 0.0)
