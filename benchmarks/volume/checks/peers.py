# SPDX-License-Identifier: GPL-3.0-or-later
"""The peers of the volume benchmark: each renders a field, function and view as well as it can."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from benchmarks.volume.cases.volumes import colors_of
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import VolumeImage
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

Result = tuple[str, np.ndarray, float]


def emission_absorption(exact: np.ndarray, *_: Any) -> np.ndarray:
    """Other programs that render the same volume are compared with the reference."""
    return exact


def transmittance_only(
    exact: np.ndarray, renderer: VolumeRenderer, transfer: TransferFunction, view: View
) -> np.ndarray:
    """volpath supports no emission: it is compared by the transmittance before a white wall."""
    from spectral_core.volume.image import Stepping
    from spectral_core.volume.march.march_input import REFERENCE

    fine = renderer.render(view, transfer, Stepping("error", "preintegrated", 0.1), limits=REFERENCE)
    return fine.transmittance.astype(np.float64)


def _shown_transmittance(image: VolumeImage) -> np.ndarray:
    return image.transmittance.astype(np.float64)


def _shown_colors(image: VolumeImage) -> np.ndarray:
    return colors_of(image, image.transfer)


@dataclass(frozen=True)
class Peer:
    """``render`` yields (setting, picture, seconds).

    ``truth`` is the exact picture, and ``shows`` selects the part of our picture that is compared with it.
    """

    name: str
    render: Callable[[ScalarVolume, TransferFunction, View, bool], Iterator[Result]]
    truth: Callable[..., np.ndarray] = emission_absorption
    shows: Callable[[VolumeImage], np.ndarray] = _shown_colors


def _least(work: Callable[[], Any], rounds: int = 3) -> tuple[Any, float]:
    best, result = np.inf, None
    for _ in range(rounds):
        start = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - start)
    return result, best


def vtk_fixed_point(volume: ScalarVolume, transfer: TransferFunction, view: View, quick: bool) -> Iterator[Result]:
    """vtkFixedPointVolumeRayCastMapper, VTK's mapper for the processor, off screen."""
    import vtk
    from vtk.util import numpy_support

    image = vtk.vtkImageData()
    image.SetDimensions(*volume.shape)
    flat = np.ascontiguousarray(volume.data.transpose(2, 1, 0)).ravel()
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(flat, deep=True))
    opacity, color = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    low, high = volume.value_range
    for value in np.unique(np.concatenate([np.linspace(low, high, 256), *(m.values for m in transfer.materials)])):
        taken, source = (part[0] for part in transfer.curves(np.array([value])))
        total = taken.sum()
        opacity.AddPoint(value, 1.0 - np.exp(-total))
        shown = source @ transfer.colors / total if total > 0 else np.zeros(3)
        color.AddRGBPoint(value, *shown)
    look = vtk.vtkVolumeProperty()
    look.SetScalarOpacity(opacity)
    look.SetColor(color)
    look.SetInterpolationTypeToLinear()
    look.ShadeOff()
    look.SetScalarOpacityUnitDistance(1.0)
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetNumberOfThreads(2)
    actor, stage, window = vtk.vtkVolume(), vtk.vtkRenderer(), vtk.vtkRenderWindow()
    actor.SetMapper(mapper)
    actor.SetProperty(look)
    stage.AddVolume(actor)
    stage.SetBackground(0, 0, 0)
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(view.width, view.height)
    window.AddRenderer(stage)
    camera = stage.GetActiveCamera()
    origin, ahead, up = (view.world_from_camera[:3, c] for c in (3, 2, 1))
    camera.SetPosition(*origin)
    camera.SetFocalPoint(*(origin + ahead))
    camera.SetViewUp(*up)
    camera.SetViewAngle(view.fov_deg)  # of the height, which is the width here
    stage.ResetCameraClippingRange()

    def shot() -> np.ndarray:
        window.Render()
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(window)
        grab.ReadFrontBufferOff()
        grab.Update()
        pixels = numpy_support.vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
        return pixels.reshape(view.height, view.width, -1)[::-1, :, :3] / 255.0

    for distance in (1.0,) if quick else (1.0, 0.5, 0.25):
        mapper.SetSampleDistance(distance)
        mapper.SetImageSampleDistance(1.0)
        window.Render()
        _, seconds = _least(window.Render)
        yield f"step {distance:g}", shot(), seconds


def yt_sampler(volume: ScalarVolume, transfer: TransferFunction, view: View, quick: bool) -> Iterator[Result]:
    """yt's VolumeRenderSampler: walks cells, ``num_samples`` in each, two threads."""
    from yt.utilities.lib.image_samplers import VolumeRenderSampler
    from yt.utilities.lib.partitioned_grid import PartitionedGrid

    data = np.ascontiguousarray(volume.data, dtype=np.float64)
    n = np.array(data.shape)
    edges = np.zeros(3), (n - 1).astype(np.float64)
    mask = np.ones(tuple(n - 1), dtype=np.uint8)
    grid = PartitionedGrid(0, [data], mask, edges[0], edges[1], (n - 1).astype(np.int64))
    origins, directions = view.rays_world()
    # yt adds along the ray what lies further in front, so its rays run from behind toward the camera.
    reach = 2.0 * float(np.linalg.norm(origins[0, 0] - volume.corners_world.mean(axis=0)))
    start = np.ascontiguousarray((origins + reach * directions).transpose(1, 0, 2))
    along = np.ascontiguousarray((-reach * directions).transpose(1, 0, 2))
    function = _YtTransfer(volume, transfer, reach)
    unit = np.ones(3)
    for samples in (1,) if quick else (3, 24):
        picture = np.zeros((view.width, view.height, 4))
        around = (0.5 * unit, (0.0, 1.0, 0.0, 1.0), picture, unit, unit, unit)
        sampler = VolumeRenderSampler(start, along, *around, "KDTree", function, samples, lens_type="none")
        begin = time.perf_counter()
        sampler(grid, num_threads=2)
        yield f"{samples} per cell", np.array(sampler.aimage).transpose(1, 0, 2)[..., :3], time.perf_counter() - begin


class _YtTransfer:
    """Transfer function for yt's sampler: a table per channel, per length of a whole ray."""

    def __init__(self, volume: ScalarVolume, transfer: TransferFunction, reach: float) -> None:
        low, high = volume.value_range
        # Its tables read 0 at their upper bound, so they reach a little further.
        values = np.linspace(low, high + 1e-3 * (high - low), 2048)
        taken, source = transfer.curves(values)
        columns = np.column_stack([source @ transfer.colors, taken.sum(-1)]) * reach
        self.tables = [SimpleNamespace(y=np.ascontiguousarray(c), x_bounds=(low, float(values[-1]))) for c in columns.T]
        self.n_field_tables, self.grey_opacity = 4, 1
        self.field_ids, self.weight_field_ids, self.weight_table_ids = [0] * 6, [-1] * 6, [-1] * 6
        self.field_table_ids = [0, 1, 2, 3, 3, 3]


def volpath(volume: ScalarVolume, transfer: TransferFunction, view: View, quick: bool) -> Iterator[Result]:
    """Mitsuba's volumetric path tracer: the same extinction before a white wall; its picture is the transmittance."""
    import mitsuba as mi

    from spectral_core.llvm_library import use_newest_llvm

    use_newest_llvm()
    mi.set_variant("llvm_ad_mono")
    taken = transfer.curves(volume.data.astype(np.float64))[0].sum(-1)
    texture = mi.VolumeGrid(mi.TensorXf(np.ascontiguousarray(taken.transpose(2, 1, 0)[..., None]).astype(np.float32)))
    place = mi.ScalarTransform4f().translate([-0.5] * 3).scale(list(volume.shape))
    medium = {
        "type": "heterogeneous",
        "albedo": 0.0,
        "sigma_t": {"type": "gridvolume", "grid": texture, "to_world": place, "raw": True},
    }
    box = mi.ScalarTransform4f().translate([n / 2 - 0.5 for n in volume.shape]).scale([n / 2 for n in volume.shape])
    film = {"type": "hdrfilm", "width": view.width, "height": view.height, "rfilter": {"type": "box"}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "volpath", "max_depth": 4},
            "sensor": view.mitsuba_sensor() | {"film": film | {"pixel_format": "luminance"}},
            "box": {"type": "cube", "to_world": box, "bsdf": {"type": "null"}, "interior": medium},
            "white": {"type": "constant", "radiance": 1.0},
        }
    )
    samples = 4 if quick else 64
    mi.render(scene, spp=1)
    begin = time.perf_counter()
    picture = np.array(mi.render(scene, spp=samples))[..., 0]
    yield f"{samples} samples", picture.astype(np.float64), time.perf_counter() - begin


PEERS = (
    Peer("vtk", vtk_fixed_point),
    Peer("yt", yt_sampler),
    Peer("volpath", volpath, transmittance_only, _shown_transmittance),
)
