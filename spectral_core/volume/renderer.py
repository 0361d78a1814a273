# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of one field without a scene: the march of the integrator, without Mitsuba."""

from __future__ import annotations

import time
import warnings
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_kind
from spectral_core.errors import InvalidInputError, MissingDependencyError
from spectral_core.llvm_library import find_llvm, llvm_remedy, use_newest_llvm
from spectral_core.volume.field import VOLUME_SOURCES, ScalarVolume
from spectral_core.volume.gradient import gradient_magnitude
from spectral_core.volume.image import Stepping, VolumeImage, palette_matrix
from spectral_core.volume.march.bricks import BrickStatistics, brick_statistics, voxel_statistics
from spectral_core.volume.march.device.grid import DeviceGrid
from spectral_core.volume.march.device.voxels import DeviceVolume, opaque_doubles
from spectral_core.volume.march.dither import phase_at
from spectral_core.volume.march.loop import Marched, march
from spectral_core.volume.march.march_input import USUAL, Limits, Rays, clip_to_box
from spectral_core.volume.march.path import FieldPath, Path
from spectral_core.volume.march.rules import Rule
from spectral_core.volume.plan import plan
from spectral_core.volume.prepared import PreparedTransfer
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

_FARTHEST = 1e15  # voxels before a field: where rays begin that come from further away
THESIS_WINDOW = 2  # voxels: the rank filter's reach, and the longest step of that rule


class VolumeRenderer:
    """Renders one field; keeps on the device all data that do not depend on view or transfer function.

    ``backend`` is ``llvm`` (the processor), ``cuda``, or a Dr.Jit array module. Raises MissingDependencyError if Dr.Jit
    is not installed, InvalidInputError for voxels that ``require_renderable`` refuses.
    """

    def __init__(self, volume: ScalarVolume, backend: Any = "llvm") -> None:
        require_kind("the volume", volume, ScalarVolume, VOLUME_SOURCES)
        volume.require_renderable()
        self.volume = volume
        self.types = array_types(backend) if isinstance(backend, str) else backend
        self.device_volume = DeviceVolume(self.types, volume)
        self._statistics: dict[str, BrickStatistics] = {}
        self._prepared: tuple[TransferFunction, PreparedTransfer] | None = None

    @property
    def rounding(self) -> float:
        """Largest difference of a voxel from its value in single precision, in data units."""
        return self.device_volume.rounding

    def rounding_at(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Largest rounding error, in data units, of places of the field that have the data ``values`` (n,)."""
        return self.device_volume.rounding_at(values)

    @property
    def edge(self) -> int:
        """Brick edge in voxels: fine enough to skip empty space, coarse enough to prepare a function quickly."""
        return 2 if self.volume.data.size <= 4_200_000 else 4 if self.volume.data.size <= 1 << 28 else 8

    def statistics(self, rule: Rule) -> BrickStatistics:
        """Brick statistics that ``rule`` needs, computed once."""
        key = "thesis" if rule == "thesis" else "bricks"
        if key not in self._statistics:
            made = voxel_statistics(self.volume, THESIS_WINDOW) if rule == "thesis" else None
            self._statistics[key] = made or brick_statistics(self.volume, self.edge)
        return self._statistics[key]

    @cached_property
    def gradient(self) -> DeviceVolume:
        """Gradient magnitudes on the device, for two-dimensional transfer functions."""
        return DeviceVolume(self.types, gradient_magnitude(self.volume))

    def prepare(self, transfer: TransferFunction) -> PreparedTransfer:
        """Tables and grids for ``transfer``; the last one is cached."""
        if self._prepared is None or self._prepared[0] is not transfer:
            self._prepared = (transfer, PreparedTransfer(self, transfer))
        return self._prepared[1]

    def shown_corners(self, transfer: TransferFunction) -> NDArray[np.float64]:
        """World corners (8, 3) of the part of the field that is visible under ``transfer``; of the whole field if none
        is.
        """
        low, high = self.prepare(transfer).grid("error").grid.bounds(self.volume.shape)
        if low[0] > high[0]:
            return self.volume.corners_world
        corners = np.array([[(low, high)[i >> a & 1][a] for a in range(3)] for i in range(8)])
        return corners @ self.volume.world_from_index[:3, :3].T + self.volume.world_from_index[:3, 3]

    def steepest(self, transfer: TransferFunction) -> float:
        """Most that the data value changes over a voxel, where something is visible under ``transfer``; 0 if nothing
        is.
        """
        statistics = self.statistics("error")
        shows, _ = self.prepare(transfer).ranges.empties(statistics)
        return float(statistics.slope[shows].max(initial=0.0))

    def render(
        self,
        view: View,
        transfer: TransferFunction,
        stepping: Stepping | None = None,
        *,
        counts: bool = False,
        limits: Limits = USUAL,
    ) -> VolumeImage:
        """One ray through the middle of each pixel. Without ``stepping``, as ``plan(...)`` chooses for 50 dB.

        Reference pictures use ``REFERENCE`` for their limits.
        """
        if stepping is None:
            chosen = plan(self, view, transfer)
            stepping = chosen.stepping
            if chosen.shortfall:
                warnings.warn(chosen.shortfall, stacklevel=2)
        import drjit as dr

        start = time.perf_counter()
        x, y, order = _pixel_places(self.types, view.width, view.height)
        out = self._marched(view, transfer, stepping, (x, y), limits=limits, counts=counts)
        if counts:
            dr.schedule(out.samples, out.steps)  # evaluated with the picture; a later evaluation would repeat the march
        channels = _image(self.types, [*out.amounts, out.transmittance], order).reshape(view.height, view.width, -1)
        seconds = time.perf_counter() - start
        samples, steps = (
            (int(c.numpy().sum(dtype=np.int64)) for c in (out.samples, out.steps)) if counts else (None, None)
        )
        return VolumeImage(transfer, stepping, channels[..., :-1], channels[..., -1], seconds, samples, steps)

    @property
    def sight(self) -> VolumeRenderer:
        """Itself: these rays also look at every pixel for what a march misses."""
        return self

    @property
    def parts(self) -> int:
        """One picture."""
        return 1

    def palette(self, transfer: TransferFunction) -> NDArray[np.float64]:
        """Color (K, channels) of each material, by which the amounts of ``trace`` become a picture."""
        return palette_matrix(transfer)

    def trace(
        self,
        view: View,
        transfer: TransferFunction,
        stepping: Stepping,
        pixels: tuple[Any, Any],
        limits: Limits = USUAL,
    ) -> list[NDArray[Any]]:
        """March the rays through the picture coordinates ``pixels`` (x and y arrays, in pixels).

        Returns one array per material, the transmittance, and samples and steps per ray.
        """
        import drjit as dr

        out = self._marched(view, transfer, stepping, pixels, limits=limits, counts=True)
        channels = [*out.amounts, out.transmittance, out.samples, out.steps]
        dr.eval(channels)
        return [channel.numpy() for channel in channels]

    def _marched(
        self,
        view: View,
        transfer: TransferFunction,
        stepping: Stepping,
        pixels: tuple[Any, Any],
        *,
        limits: Limits,
        counts: bool,
    ) -> Marched:
        data = self.prepare(transfer).march_input(stepping, limits)
        rays = self.rays(view, pixels, data.grid)
        path = Path((FieldPath(data, rays),), rays.length, rays.world, phase=phase_at(self.types, *pixels))
        return march(path, counts=counts)

    def rays(self, view: View, pixels: tuple[Any, Any], grid: DeviceGrid) -> Rays:
        """Rays in index space, in double precision until they begin beside the field.

        Through voxels that are far longer along one axis, a ray from the plane of the field's center begins millions of
        short voxels outside of the field, and the small components of its direction are differences of large ones.
        """
        import drjit as dr

        types = self.types
        coefficients, back = view.index_rays(self.volume)
        x, y = (types.Array3f64(types.Float64(each)) for each in pixels)
        point, along, world = (
            dr.fma(y, per_y, dr.fma(x, per_x, fixed))
            for fixed, per_x, per_y in ([opaque_doubles(types, row) for row in block] for block in coefficients)
        )
        length = dr.sqrt(dr.dot(along, along))
        along /= length
        camera = view.origin_index(self.volume)
        middle = np.array(self.volume.shape) / 2 - 0.5 if camera is None else camera
        ahead = dr.dot(opaque_doubles(types, middle) - point, along)
        begin = dr.maximum(-dr.opaque(types.Float64, back) * length - ahead, -_FARTHEST)
        per_index = dr.sqrt(dr.dot(world, world)) / length
        start = types.Array3f(dr.fma(along, ahead, point))
        return clip_to_box(grid, start, types.Array3f(along), types.Float(per_index), types.Float(begin))


def array_types(backend: str) -> Any:
    """The Dr.Jit array module of ``llvm`` or ``cuda``."""
    if backend not in ("llvm", "cuda"):
        raise InvalidInputError(f"backend {backend!r}; expected 'llvm' or 'cuda'")
    use_newest_llvm()
    try:
        import drjit as dr
        import drjit.cuda
        import drjit.llvm
    except ImportError as error:
        raise MissingDependencyError.package("drjit", "rendering volumes", "render") from error
    wanted = dr.JitBackend.LLVM if backend == "llvm" else dr.JitBackend.CUDA
    if (backend == "llvm" and find_llvm() is None) or not dr.has_backend(wanted):
        remedy = llvm_remedy() if backend == "llvm" else "use llvm"
        raise MissingDependencyError(f"Dr.Jit finds no {backend} here; {remedy}")
    return drjit.llvm if backend == "llvm" else drjit.cuda


def _image(types: Any, channels: list[Any], order: Any) -> NDArray[np.float32]:
    """(pixels, channels): the values of ray i are at index ``order[i]``, where the marching kernel writes them.

    One packet per pixel, padded to a power of two: each further scatter to the same array would repeat the march.
    """
    import drjit as dr

    count = max(2, 1 << (len(channels) - 1).bit_length())
    packet = types.ArrayXf([*channels, *[channels[-1]] * (count - len(channels))])
    target = dr.empty(types.Float, dr.width(order) * count)
    dr.scatter(target, packet, order)
    picture: NDArray[np.float32] = target.numpy()
    return picture.reshape(-1, count)[:, : len(channels)]


@lru_cache(maxsize=8)
def _pixel_places(types: Any, width: int, height: int) -> tuple[Any, Any, Any]:
    """x and y of all pixel centers and each pixel's number, on the device, in tiles of 4×4.

    Sixteen rays march together; those of a tile share bricks longer than those of a row, which saves an eighth of the
    time.
    """
    row, column = np.divmod(np.arange(width * height), width)
    order = np.lexsort((column % 4, row % 4, column // 4, row // 4))
    x, y = ((part[order] + 0.5).astype(np.float32) for part in (column, row))
    return types.Float(x), types.Float(y), types.UInt32(order.astype(np.uint32))
