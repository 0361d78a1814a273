# SPDX-License-Identifier: GPL-3.0-or-later
"""Hard cases, counted: every one finite and right against the NumPy oracle, bad voxels refused by index.

Right means: amounts within 60 dB of the oracle's for a 60 dB request (55 dB where float32 or a jump sets the limit, as
listed), transmittance within 2e-3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.checks.oracle import march_oracle
from spectral_core.errors import InvalidInputError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.plan import plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View


@dataclass(frozen=True)
class Case:
    """A field, function and view, and the relative error that its picture may have."""

    name: str
    volume: ScalarVolume
    transfer: TransferFunction
    view: View
    limit: float = 1e-3


def run(options: Options) -> dict[str, Any]:
    figures: dict[str, Any] = {"cases": 0, "right": 0, "finite": 0, "wrong": []}
    for case in cases(8 if options.quick else 14):
        error, away, finite = judge(case)
        right = finite and error <= case.limit and away <= 2e-3
        figures["cases"] += 1
        figures["right"] += right
        figures["finite"] += finite
        if not right:
            figures["wrong"].append(case.name)
        print(f"{case.name:34} error {error:.1e}  transmittance {away:.1e}  {'right' if right else 'WRONG'}")
    figures["refused"] = sum(refused(bad) for bad in (np.nan, np.inf, -np.inf))
    print(f"{figures['right']} of {figures['cases']} right, {figures['finite']} finite, {figures['refused']} of 3 bad voxels refused by name and index")  # fmt: skip  # noqa: E501
    figures["holds"] = {
        "every case is right against the oracle": figures["right"] == figures["cases"],
        "bad voxels are refused by name and index": figures["refused"] == 3,
    }
    return figures


def judge(case: Case) -> tuple[float, float, bool]:
    """(relative error of amounts, greatest error of transmittance, all finite)."""
    renderer = VolumeRenderer(case.volume)
    made = plan(renderer, case.view, case.transfer, 70.0)
    image = renderer.render(case.view, case.transfer, made.stepping)
    begin = -np.inf if case.view.fov_deg is None else 0.0
    exact = march_oracle(case.volume, case.transfer, case.view.rays_world(), 0.01, begin)
    amounts = exact.amounts.reshape(image.amounts.shape)
    finite = bool(np.isfinite(image.amounts).all() and np.isfinite(image.transmittance).all())
    norm = float(np.linalg.norm(amounts))
    error = float(np.linalg.norm(image.amounts - amounts)) / (norm or 1.0)
    away = float(np.abs(image.transmittance - exact.transmittance.reshape(image.transmittance.shape)).max())
    return error, away, finite


def ramp(low: float, high: float, extinction: float, emission: float = 0.0) -> TransferFunction:
    """One material that rises from ``low`` to ``high``."""
    grows = np.array([0.0, 1.0])
    return TransferFunction((Material("m", [low, high], grows * extinction, [1, 1, 1], grows * emission),))


def cases(pixels: int) -> Iterator[Case]:
    """Every hard case of the room's brief."""
    rng = np.random.default_rng(5)

    def around(volume: ScalarVolume, azimuth: float = 31.0, elevation: float = 23.0, **rest: Any) -> View:
        return View.around(volume, azimuth, elevation, width=pixels, height=pixels, **rest)

    def case(name: str, data: Any, transfer: TransferFunction, limit: float = 1e-3, **rest: Any) -> Case:
        volume = data if isinstance(data, ScalarVolume) else ScalarVolume(name, np.asarray(data))
        return Case(name, volume, transfer, around(volume, **rest), limit)

    n = 16
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, n)] * 3, indexing="ij")
    ball = 200 * np.exp(-3 * (x**2 + y**2 + z**2))
    smooth = ScalarVolume("ball", ball.astype(np.uint8))
    over = ramp(20, 200, 0.3)
    for value in (0, 77, 255):
        yield case(f"constant {value}", np.full((n, n, n), value, np.uint8), ramp(10, 255, 0.1))
    yield case("step field", np.where(x > 0, 200, 0).astype(np.uint8), over)
    yield case("checkerboard", (255 * (np.indices((n, n, n)).sum(0) % 2)).astype(np.uint8), ramp(0, 255, 0.2))
    yield case("noise", rng.integers(0, 256, (n, n, n)).astype(np.uint8), ramp(0, 255, 0.2))
    for thin in (1, 2):
        for axis in range(3):
            shape = [12, 12, 12]
            shape[axis] = thin
            yield case(f"{thin} voxel thin, axis {axis}", rng.random(shape).astype(np.float32), ramp(0, 1, 0.5))
    yield case("a single voxel", np.full((1, 1, 1), 3, np.int16), ramp(0, 3, 0.5))
    yield case("values below the knots", ball - 150, ramp(10, 40, 0.3))
    yield case("values above the knots", ball * 100, ramp(10, 4000, 0.3))
    yield case("no value within the knots", smooth, ramp(300, 400, 0.3))
    yield case("a jump in the function", smooth, TransferFunction((Material("m", [0, 90, 90, 255], [0, 0, 0.3, 0.3], [1, 1, 1]),)), 3e-3)  # fmt: skip  # noqa: E501
    for factor, name in ((1e8, "1e8"), (1e-8, "1e-8")):
        yield case(f"extinction × {name}", smooth, over.scaled(factor), 2e-2 if factor > 1 else 1e-3)
    yield case("emission, no extinction", smooth, ramp(20, 200, 0.0, 0.1))
    mixed = TransferFunction((*over.materials, Material("x", [50, 150], [0, 0], [1, 1, 1], [0, 0.2])))
    yield case("extinction beside x-ray", smooth, mixed)
    for axis in range(3):
        yield Case(f"rays parallel to axis {axis}", smooth, over, parallel(smooth, axis, pixels))
    yield Case("rays in the voxels' planes", smooth, over, parallel(smooth, 0, n))
    face = View.looking([-0.5, 7.5, 7.5], [9.0, 8.0, 7.0], width=pixels, height=pixels, fov_deg=70.0)
    yield Case("camera on a face", smooth, over, face)
    corner = View.looking([-0.5, -0.5, -0.5], [9.0, 8.0, 7.0], width=pixels, height=pixels, fov_deg=70.0)
    yield Case("camera on a corner", smooth, over, corner)
    inside = View.looking([7.5, 7.5, 7.5], [15.0, 8.0, 7.0], width=pixels, height=pixels, fov_deg=90.0)
    yield Case("camera inside", smooth, over, inside)
    away = View.looking([-50.0, 7.5, 7.5], [-90.0, 7.5, 7.5], width=pixels, height=pixels)
    yield Case("field behind the camera", smooth, over, away)
    yield case("anisotropic voxels", ScalarVolume.from_spacing("a", smooth.data, (1.0, 0.3, 4.0)), over)
    shear = np.array([[1.0, 0.6, 0.2, 3], [0.0, 0.8, -0.5, 1], [0.1, 0.0, 1.2, -7], [0, 0, 0, 1]])
    yield case("sheared voxels", ScalarVolume("s", smooth.data, shear), over)
    yield case("mirrored voxels", ScalarVolume("m", smooth.data, np.diag([-1.0, 1.0, 1.0, 1.0])), over)
    for scale in (1e6, 1e-6):
        yield case(f"world scale {scale:g}", ScalarVolume.from_spacing("w", smooth.data, [scale] * 3, [5 * scale] * 3), over.scaled(1 / scale))  # fmt: skip  # noqa: E501
    yield case("int16 data", (40 * ball - 4000).astype(np.int16), ramp(-3000, 4000, 0.3))
    yield case("uint16 data", (300 * ball).astype(np.uint16), ramp(6000, 60000, 0.3))
    yield case("float64 data, large offset", ball + 1e6, ramp(1e6 + 20, 1e6 + 200, 0.3))
    yield case("float64 data, tiny values", ball * 1e-30, ramp(20e-30, 200e-30, 0.3))
    yield case("uint8, one voxel differs", _speck(n), ramp(0, 255, 1.0))
    yield case("orthographic", smooth, over, fov_deg=None)


def parallel(volume: ScalarVolume, axis: int, pixels: int) -> View:
    """Orthographic, exactly along an axis; with as many pixels as voxels the rays run through voxel centers."""
    toward, up = np.eye(3)[axis], np.eye(3)[(axis + 1) % 3]
    middle = volume.corners_world.mean(axis=0)
    width = float(volume.shape[0])
    return View.looking(middle - 50 * toward, middle, up, width=pixels, height=pixels, fov_deg=None, ortho_width=width)


def _speck(n: int) -> np.ndarray:
    data = np.zeros((n, n, n), np.uint8)
    data[5, 9, 3] = 255
    return data


def refused(bad: float) -> bool:
    """A bad voxel is refused with the field's name and the voxel's index."""
    data = np.zeros((4, 5, 6), np.float32)
    data[3, 1, 2] = bad
    try:
        ScalarVolume("liver", data)
    except InvalidInputError as error:
        return "liver" in str(error) and "(3, 1, 2)" in str(error)
    return False


__all__ = ["Stepping", "cases", "judge", "run"]
