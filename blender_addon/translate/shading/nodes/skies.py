# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures by direction: environment images and skies."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import ImageTexture
from spectral_core.scene.skies.atmosphere import Atmosphere
from spectral_core.scene.skies.daylight import has_hosek

from ..image_files import MISSING
from ..images import image_of_node
from ..reader import Reader, evaluator
from ..tree import Output
from .textures import place_of

SKY_ROWS = 512
"""Rows of the picture of a sky."""
LAST_ROWS = (0.5 / SKY_ROWS, 1 - 0.5 / SKY_ROWS)
"""Heights in the picture of the middles of its first and last rows: beyond one it would go on with the other."""
WIDE_SUN = 0.1
"""Angle (radian) above which the sun's disk is drawn into the sky: a light is evenly bright."""
MIDDLE_SUN, LOW = 0.02, 0.1
"""Angle above which a disk is drawn if its lower edge is lower than ``LOW``, where its color changes across it."""
PARTS = 4
"""Directions across a pixel, and up in it, of the sun's disk; twice as many up at the horizon."""
HOSEK_SHARE = 0.19
"""Brightness of Cycles' sky of Hosek and Wilkie relative to Preetham's, which replaces it without its data."""
CLEAR = 3.0
"""Turbidity up to which the sky of Hosek and Wilkie by coefficients for RGB is near Cycles', by those for XYZ."""
MODELS: dict[str, Any] = {
    "SINGLE_SCATTERING": "single", "NISHITA": "single", "MULTIPLE_SCATTERING": "multiple", "PREETHAM": "preetham",
    "HOSEK_WILKIE": "hosek",
}  # fmt: skip


@evaluator("TEX_ENVIRONMENT")
def _environment(reader: Reader, output: Output) -> Any:
    node = output.node
    texture = image_of_node(reader.translation, output, reader.owner)
    if texture is None:
        return np.array(MISSING)
    direction = place_of(reader, output, "position")
    if node.projection == "MIRROR_BALL":
        place = reader.emit("ball_place", direction)
    else:
        place = reader.emit("sphere_place", direction, settings=(True,))
    return reader.emit("image_color", place, settings=(False,), data=replace(texture, extension="repeat"))


@evaluator("TEX_SKY")
def _sky(reader: Reader, output: Output) -> Any:
    node = output.node
    model = MODELS.get(node.sky_type, "multiple")
    is_replaced = model == "hosek" and not has_hosek()
    if is_replaced:
        reader.note(f"{output.label!r}: the Hosek-Wilkie sky is drawn as Preetham's; Mitsuba's data are missing")
        model = "preetham"
    if model in ("preetham", "hosek"):
        toward = tuple(float(part) for part in node.sun_direction)
        if model == "hosek" and node.turbidity > CLEAR:
            reader.note(
                f"{output.label!r}: its turbidity of {node.turbidity:g} is above {CLEAR:g}, where the colors of the "
                "Hosek-Wilkie sky differ from Cycles': these are fitted in RGB, those in XYZ"
            )
        own = {"turbidity": float(node.turbidity), "ground_albedo": float(node.ground_albedo)}
        atmosphere = Atmosphere(model, sun_direction=toward, **own)  # type: ignore[arg-type]
    else:
        aerosol = getattr(node, "aerosol_density", getattr(node, "dust_density", 1.0))  # its name before Blender 5.0
        # a sun that goes on past the zenith goes down on the other side, so that a day can be animated
        elevation = float(np.arcsin(np.sin(node.sun_elevation)))
        rotation = node.sun_rotation + (np.pi if np.cos(node.sun_elevation) < 0 else 0.0)
        atmosphere = Atmosphere(
            model, elevation, rotation, node.altitude, node.air_density, aerosol, node.ozone_density
        )
    share = HOSEK_SHARE if is_replaced else 1.0
    angle = float(node.sun_size) if model in ("single", "multiple") and node.sun_disc else 0.0
    pixels, angle = drawn(atmosphere, angle, float(node.sun_intensity))
    texture = ImageTexture("sky", (share * pixels).astype(np.float32), "linear", "repeat")
    reader.skies[id(texture)] = (texture, atmosphere, angle, float(node.sun_intensity))
    place = reader.emit("sphere_place", _upright(reader, place_of(reader, output, "generated")), settings=(False,))
    across, up = (reader.emit("component", place, settings=(axis,)) for axis in range(2))
    up = reader.emit("clamp", up, *LAST_ROWS, settings=("MINMAX",))
    return reader.emit("image_color", reader.emit("joined", across, up, 0.0), settings=(False,), data=texture)


def drawn(atmosphere: Atmosphere, angle: float, intensity: float) -> tuple[NDArray[np.float64], float]:
    """Radiance (rows, columns, 3) of a sky, with its sun's disk where no light can stand for that; and the angle
    (radian) of the disk, 0 if it is drawn.
    """
    pixels = _picture(atmosphere, SKY_ROWS)
    if angle <= 0 or not _is_drawn(atmosphere, angle):
        return pixels, angle
    return pixels + _disk(atmosphere, angle) * intensity, 0.0


@lru_cache(maxsize=2)  # 13 MB each
def _picture(atmosphere: Atmosphere, height: int) -> NDArray[np.float64]:
    """Radiance (rows, columns, 3) of a sky, ``height`` rows; at the horizon, where it has a step, the mean over each
    pixel.
    """
    pixels = atmosphere.radiance(_directions(np.arange(height)))
    steps = np.array([0.0, atmosphere.horizon])
    # the mean of a row keeps the light of a bright edge that is narrower than the row
    rows = np.unique(_row_of(steps)[:, None] + [-1, 0, 1])
    places = (np.arange(2 * PARTS) + 0.5) / (2 * PARTS) - 0.5
    pixels[rows] = np.mean([atmosphere.radiance(_directions(rows + place)) for place in places], axis=0)
    pixels.flags.writeable = False
    return pixels


def _disk(atmosphere: Atmosphere, angle: float) -> NDArray[np.float64]:
    """Mean radiance (rows, columns, 3) of the sun's disk of an angle (radian) over each pixel, 0 beside it."""
    pixels = np.zeros((SKY_ROWS, 2 * SKY_ROWS, 3))
    low, high = _row_of(atmosphere.sun_elevation + np.array([-angle, angle]) / 2)
    rows = np.arange(low - 1, high + 2)
    parts = PARTS if angle < 0.5 else 1
    across, up = ((np.arange(count) + 0.5) / count - 0.5 for count in (parts, 2 * parts))
    found = [atmosphere.wide_sun(_directions(rows + y, x), angle) for x in across for y in up]
    pixels[rows] = np.mean(found, axis=0)
    return pixels


def _directions(rows: NDArray[Any], shift: float = 0.0) -> NDArray[np.float64]:
    """Unit directions (rows, columns, 3) of places of a sky's picture; ``shift``: of all columns."""
    from ...lighting.backgrounds import direction_at

    columns, heights = np.meshgrid(np.arange(2 * SKY_ROWS) + shift, rows)
    return direction_at(columns, heights, SKY_ROWS)


def _row_of(elevation: NDArray[np.float64]) -> NDArray[np.int64]:
    """Rows of a sky's picture at elevations (radian)."""
    return np.clip((elevation / np.pi + 0.5) * SKY_ROWS, 1, SKY_ROWS - 2).astype(np.int64)


def _is_drawn(atmosphere: Atmosphere, angle: float) -> bool:
    """True if a light, which is evenly bright and a full disk, cannot stand for the sun's disk of an angle."""
    lower_edge = atmosphere.sun_elevation - angle / 2
    return angle > WIDE_SUN or lower_edge < (LOW if angle > MIDDLE_SUN else atmosphere.horizon)


def _upright(reader: Reader, vector: Any) -> Any:
    """The unit direction that Cycles finds for a vector of any length: its z is the sine of the elevation as it is."""
    x, y, z = (reader.emit("component", vector, settings=(axis,)) for axis in range(3))
    z = reader.emit("clamp", z, -1.0, 1.0, settings=("MINMAX",))
    flat = reader.emit("normalize", reader.emit("joined", x, y, 0.0))
    squared = reader.emit("math", z, z, 0.0, settings=("MULTIPLY",))
    across = reader.emit("math", reader.emit("math", 1.0, squared, 0.0, settings=("SUBTRACT",)), 0.0, 0.0,
                         settings=("SQRT",))  # fmt: skip
    level = reader.emit("vector_math", flat, 0.0, 0.0, across, settings=("SCALE",))
    up = reader.emit("joined", 0.0, 0.0, z)
    return reader.emit("vector_math", level, up, 0.0, 0.0, settings=("ADD",))
