# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of `adaptive_volume`: fields with their transfer functions, and the parameters of the integrator.

A scene dictionary or XML file cannot hold Python objects, so fields are passed by handle (``integrator_dict``), by file
name (``file``) or as Mitsuba's own grid volumes (``volume``).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.march_input import QUADRATURES
from spectral_core.volume.march.rules import RULES
from spectral_core.volume.presets import preset
from spectral_core.volume.transfer import TransferFunction


@dataclass(frozen=True, eq=False)
class SceneVolume:
    """A field and its transfer function; its name is the prefix of its extra channels.

    ``gains``, one per material, multiply its light (None: 1). They are separate from the colors, because the spectrum
    of half a color is not half its spectrum. ``rule`` is its step rule, None for that of the integrator. The camera
    sees it only with ``in_camera``; it takes light from lamps to what they light only with ``in_shadow``, and from
    later segments of paths only with ``in_bounces``. Raises InvalidInputError for voxels of a size not rendered.
    """

    volume: ScalarVolume
    transfer: TransferFunction
    gains: tuple[float, ...] | None = None
    rule: str | None = None
    in_camera: bool = True
    in_shadow: bool = True
    in_bounces: bool = True

    def __post_init__(self) -> None:
        self.volume.require_renderable()  # an error inside of Mitsuba would be the text of a traceback


@dataclass(frozen=True)
class VolumeSettings:
    """Parameters of `adaptive_volume`; each is a property of the integrator.

    ``quality`` is the SNR in dB that pilot rays find steps for; ``scale`` (above 0) fixes the steps instead.
    ``jitter`` draws the length of each ray's first step. ``channels`` adds K material channels and the transmittance
    to the picture. ``shading`` lights lit materials with the scene's lights by the field's gradient, instead of
    evenly with ``light``, a catalogue name. ``shadows`` lets fields and surfaces shadow each other, with paths of at
    most ``max_depth`` surfaces; without it the nested surface integrator knows nothing of the fields.
    """

    rule: str = "auto"
    quadrature: str = "auto"
    quality: float = 50.0
    scale: float = 0.0
    jitter: bool = False
    channels: bool = False
    shading: bool = False
    shadows: bool = False
    light: str = "D65"
    max_depth: int = 6

    def __post_init__(self) -> None:
        if self.rule not in (*RULES, "auto"):
            raise UnknownNameError.among("step rule", self.rule, (*RULES, "auto"))
        if self.quadrature not in (*QUADRATURES, "auto"):
            raise UnknownNameError.among("quadrature", self.quadrature, (*QUADRATURES, "auto"))
        require_range("quality", self.quality, 10.0, 90.0, " dB")
        require_range("scale", self.scale, 0.0, 64.0)
        if self.max_depth < 1:
            raise InvalidInputError(f"max_depth is {self.max_depth}; expected at least 1")


_shared: dict[str, SceneVolume] = {}
_numbers = count(1)


def share(item: SceneVolume) -> str:
    """Handle by which an integrator of this process finds ``item``; ``release`` it after use."""
    handle = f"volume-{next(_numbers)}"
    _shared[handle] = item
    return handle


def release(handle: str) -> None:
    """Forget a shared field; integrators that were loaded with it keep it."""
    _shared.pop(handle, None)


def integrator_dict(items: list[SceneVolume], surface: dict[str, Any] | None = None, **settings: Any) -> dict[str, Any]:
    """Mitsuba dictionary of an `adaptive_volume` that shows ``items``; settings as in ``VolumeSettings``.

    ``surface`` is the dictionary of the integrator for surfaces; without it they only occlude. The fields
    stay shared until ``release`` is called for each handle of its ``handles`` (separated by commas).
    """
    if not items:
        raise InvalidInputError("an adaptive_volume integrator needs at least one field; give it a SceneVolume")
    VolumeSettings(**settings)
    made = {"type": "adaptive_volume", "handles": ",".join(share(item) for item in items), **settings}
    return made if surface is None else made | {"surface": surface}


_PREFIXES = ("file", "transfer", "to_world")
"""Properties that occur once per field, alone or with the field's name after an underscore."""


def require_known(props: Any, nested: tuple[type, ...]) -> None:
    """Raise an error for unknown properties, with the nearest known name.

    Parameters
    ----------
    props
        Mitsuba's properties.
    nested
        Types of nested objects, which may have any name.
    """
    known = [*(field.name for field in fields(VolumeSettings)), "handles", *_PREFIXES]
    names = [key for key in props.keys() if not isinstance(props[key], nested)]  # noqa: SIM118 (no mapping)
    grids = {key[len("volume") :] for key in props.keys() if key.startswith("volume")}  # noqa: SIM118
    files = {key[len("file") :] for key in names if key == "file" or key.startswith("file_")}
    for key in names:
        prefix = next((p for p in _PREFIXES if key == p or key.startswith(f"{p}_")), None)
        if key not in known and prefix is None:
            raise UnknownNameError.among("property of adaptive_volume", key, known)
        if prefix not in (None, "file") and key != "transfer" and key[len(str(prefix)) :] not in grids | files:
            raise InvalidInputError(
                f"adaptive_volume: {key!r} belongs to no field; name it as its file_NAME or volume_NAME is named"
            )


def read_settings(props: Any) -> VolumeSettings:
    """The plain settings among a plugin's properties."""
    return VolumeSettings(**{field.name: props.get(field.name, field.default) for field in fields(VolumeSettings)})


def read_volumes(props: Any, grids: dict[str, Any]) -> list[SceneVolume]:
    """The fields that a plugin's properties name; ``grids`` are its nested Mitsuba volumes by property name.

    ``file``, ``file_NAME``: a volume file. ``transfer``, ``transfer_NAME`` beside it (or beside ``volume_NAME``): a
    transfer function file or ``preset:NAME``. ``to_world_NAME``: placement of a grid volume's unit cube.
    """
    items = []
    for handle in filter(None, str(props.get("handles", "")).split(",")):
        if handle not in _shared:
            raise InvalidInputError(
                f"adaptive_volume: no field is shared as {handle!r}; it was released, or never shared"
            )
        items.append(_shared[handle])
    for key in [key for key in props.keys() if key == "file" or key.startswith("file_")]:  # noqa: SIM118
        from spectral_core.volume.files import read_volume

        items.append(_with_transfer(read_volume(Path(str(props[key]))), props, key[len("file") :]))
    for key, grid in grids.items():
        suffix = key[len("volume") :] if key.startswith("volume") else ""
        items.append(_with_transfer(_grid_volume(key, grid, props.get("to_world" + suffix, None)), props, suffix))
    if not items:
        raise InvalidInputError("adaptive_volume has no field; give it handles, file or a nested volume")
    return items


def _with_transfer(volume: ScalarVolume, props: Any, suffix: str) -> SceneVolume:
    given = str(props.get("transfer" + suffix, props.get("transfer", "preset:wide")))
    if given.startswith("preset:"):
        return SceneVolume(volume, preset(given[len("preset:") :], volume))
    from spectral_core.volume.documents.transfer_file import read_transfer

    return SceneVolume(volume, read_transfer(Path(given)).for_volume(volume))


def _grid_volume(name: str, grid: Any, to_world: Any) -> ScalarVolume:
    """A Mitsuba grid volume of one channel as a field: texels are voxels, its unit cube is placed by ``to_world``."""
    import mitsuba as mi

    data = np.array(mi.traverse(grid)["data"])
    if data.ndim == 4 and data.shape[3] != 1:
        raise InvalidInputError(f"{name} has {data.shape[3]} channels; expected one")
    field = data.reshape(data.shape[:3]).transpose(2, 1, 0)
    box = grid.bbox()
    if to_world is None:
        matrix = np.diag([*(np.array(box.max) - np.array(box.min)).ravel(), 1.0])
        matrix[:3, 3] = np.array(box.min).ravel()
    else:
        matrix = np.array(to_world.matrix, dtype=np.float64).reshape(4, 4)
    texels = np.diag([*(1.0 / np.array(field.shape)), 1.0])
    texels[:3, 3] = 0.5 / np.array(field.shape)
    return ScalarVolume(name, field, matrix @ texels)
