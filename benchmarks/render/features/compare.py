# SPDX-License-Identifier: GPL-3.0-or-later
"""Difference of two pictures of one scene, robust to fireflies, on the ball and in all."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float64]

BLOCK = 4
"""Edge of the blocks of pixels whose means are compared."""
DARKEST = 0.02
"""Share of the whole picture's mean that a darker region's error is measured against."""


@dataclass(frozen=True)
class Comparison:
    """``error``: the worst of the regions; ``noise``: the same measure between two seeds of Cycles."""

    error: float
    noise: float
    ratio: float
    by_region: dict[str, float]


BLACK = 5e-3
"""Least mean that an error is relative to: a fiftieth of the stage's own level."""


def render(engine: str, seed: int, *, raw: bool = False) -> Pixels:
    """RGBA (height, width, 4) of the current scene, linear; ``raw``: with numbers that are not finite."""
    import bpy

    from blender_addon import compat

    scene = bpy.context.scene
    scene.render.engine = engine
    scene.cycles.seed = scene.spectral.render.seed = seed
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "frame.exr")
        compat.set_image_format(scene.render.image_settings, "OPEN_EXR", color_depth="32", color_mode="RGBA")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath, check_existing=False)
        pixels = np.array(image.pixels[:]).reshape(*reversed(image.size[:]), 4)
        bpy.data.images.remove(image)
    return pixels if raw else np.nan_to_num(pixels, posinf=1e6, neginf=0.0)


def compare(ours: Pixels, cycles: list[Pixels], ball: NDArray[np.bool_]) -> Comparison:
    """Error of our picture against the mean of two of Cycles'; ``ball``: pixels (height, width) on the ball.

    A region's error is the mean absolute difference of block means over the region's mean; blocks average noise away
    and show what is misplaced. The difference of two seeds of Cycles is subtracted in quadrature.
    """
    if ours.shape != cycles[0].shape:
        return Comparison(1.0, 0.0, 0.0, {"size": 1.0})
    first, second, mine = (_calm(picture) for picture in (*cycles, ours))
    truth = (first + second) / 2
    # of magnitudes: the emission of coordinates is as often negative as positive, so that its mean is near 0
    overall = float(np.abs(truth[..., :3]).mean())
    regions = {"all": np.ones(truth.shape[:2], bool)}
    if ball.shape == truth.shape[:2] and 0.02 < ball.mean() < 0.98:
        regions |= {"ball": ball, "rest": ~ball}
    by_region, noises = {}, []
    for name, mask in regions.items():
        base = max(float(np.abs(truth[mask][:, :3]).mean()), DARKEST * overall, BLACK)
        error = _distance(mine, truth, mask) / base
        # two seeds differ by sqrt(2) of one's noise, ours and the mean of two by at most sqrt(1.5) of it
        noise = _distance(first, second, mask) / base
        by_region[name] = float(np.sqrt(max(error**2 - noise**2, 0.0)))
        noises.append(noise)
    by_region["alpha"] = float(np.abs(ours[..., 3] - (cycles[0][..., 3] + cycles[1][..., 3]) / 2).mean())
    ratio = float(np.abs(mine[..., :3]).mean() / max(overall, 1e-9))
    return Comparison(max(by_region.values()), max(noises), ratio, by_region)


def _distance(one: Pixels, other: Pixels, mask: NDArray[np.bool_]) -> float:
    """Mean over blocks that hold enough of the region of the difference of their means."""
    weight = _blocks(mask.astype(float)[..., None])[..., 0]
    means = [_blocks(picture[..., :3] * mask[..., None]) for picture in (one, other)]
    used = weight > 0.25
    if not used.any():
        return 0.0
    return float((np.abs(means[0] - means[1]).mean(-1)[used] / weight[used]).mean())


def _blocks(picture: Pixels) -> Pixels:
    height, width = (size // BLOCK * BLOCK for size in picture.shape[:2])
    cut = picture[:height, :width]
    return cut.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1).mean((1, 3))


def _calm(picture: Pixels) -> Pixels:
    """The picture with single pixels that outshine their neighborhood fivefold (fireflies) brought down to it."""
    padded = np.pad(picture[..., :3], ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = picture.shape[:2]
    around = np.stack([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)])
    middle, second = np.median(around, axis=0), np.sort(around, axis=0)[-3]
    calm = picture.copy()
    wild = picture[..., :3] > 5 * np.maximum(second, middle) + 1e-3
    calm[..., :3] = np.where(wild, second, picture[..., :3])
    return calm


def ball_mask(stage: Any) -> NDArray[np.bool_]:
    """Pixels (height, width) that see the stage's ball where nothing has moved; row 0 at the bottom."""
    from benchmarks.render.features.stage import BALL_RADIUS

    stage.layer.update()  # Blender computes matrices late: a camera that was just placed still has the identity
    scene, camera = stage.scene, stage.camera
    render = scene.render
    width, height = render.resolution_x, render.resolution_y
    frame = [np.array(corner[:]) for corner in camera.data.view_frame(scene=scene)]  # right top, …, counterclockwise
    right, up = frame[0] - frame[3], frame[0] - frame[1]
    x, y = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    local = frame[2] + x[None, :, None] * right + y[:, None, None] * up
    matrix = np.array(camera.matrix_world)
    directions = local @ matrix[:3, :3].T
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    toward = np.array([0.0, 0.0, BALL_RADIUS]) - matrix[:3, 3]
    along = directions @ toward
    return np.asarray(toward @ toward - along**2 < (0.97 * BALL_RADIUS) ** 2)
