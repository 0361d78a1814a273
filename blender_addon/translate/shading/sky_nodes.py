# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures by direction: environment images and skies."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from spectral_core.scene import ImageTexture
from spectral_core.scene.atmosphere import Atmosphere
from spectral_core.scene.daylight import has_hosek

from .image_files import MISSING
from .images import image_of_node
from .reader import Reader, evaluator
from .texture_nodes import place_of
from .tree import Output

SKY_ROWS = 512
"""Rows of the picture of a sky."""
WIDE_SUN = 0.1
"""Angle (radian) above which the sun's disk is drawn into the sky: a light is evenly bright."""
HOSEK_SHARE = 0.19
"""Brightness of Cycles' sky of Hosek and Wilkie relative to Preetham's, which replaces it without its data."""
MODELS: dict[str, Any] = {
    "SINGLE_SCATTERING": "single", "NISHITA": "single", "MULTIPLE_SCATTERING": "multiple", "PREETHAM": "preetham",
    "HOSEK_WILKIE": "hosek",
}  # fmt: skip


@evaluator("TEX_ENVIRONMENT")
def _environment(reader: Reader, output: Output) -> Any:
    node = output.node
    texture = image_of_node(reader.translation, node, reader.owner, output.socket.name)
    if texture is None:
        return np.array(MISSING)
    projection = "ball_place" if node.projection == "MIRROR_BALL" else "sphere_place"
    place = reader.emit(projection, place_of(reader, output, "position"))
    return reader.emit("image_color", place, settings=(False,), data=replace(texture, extension="repeat"))


@evaluator("TEX_SKY")
def _sky(reader: Reader, output: Output) -> Any:
    from ..lighting.backgrounds import directions_of

    node = output.node
    model = MODELS.get(node.sky_type, "multiple")
    is_replaced = model == "hosek" and not has_hosek()
    if is_replaced:
        reader.note(f"{output.label!r}: the Hosek-Wilkie sky is drawn as Preetham's; Mitsuba's data are missing")
        model = "preetham"
    if model in ("preetham", "hosek"):
        toward = tuple(float(part) for part in node.sun_direction)
        own = {"turbidity": float(node.turbidity), "ground_albedo": float(node.ground_albedo)}
        atmosphere = Atmosphere(model, sun_direction=toward, **own)  # type: ignore[arg-type]
    else:
        aerosol = getattr(node, "aerosol_density", getattr(node, "dust_density", 1.0))  # its name before Blender 5.0
        atmosphere = Atmosphere(
            model, node.sun_elevation, node.sun_rotation, node.altitude, node.air_density, aerosol, node.ozone_density
        )
    share = HOSEK_SHARE if is_replaced else 1.0
    directions = directions_of(SKY_ROWS)
    pixels = (share * atmosphere.radiance(directions)).astype(np.float32)
    angle = float(node.sun_size) if model in ("single", "multiple") and node.sun_disc else 0.0
    if angle > WIDE_SUN:
        pixels += (atmosphere.wide_sun(directions, angle) * float(node.sun_intensity)).astype(np.float32)
        angle = 0.0
    texture = ImageTexture("sky", pixels, "linear", "repeat")
    reader.skies[id(texture)] = (texture, atmosphere, angle, float(node.sun_intensity))
    place = reader.emit("sphere_place", _upright(reader, place_of(reader, output, "generated")))
    return reader.emit("image_color", place, settings=(False,), data=texture)


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
