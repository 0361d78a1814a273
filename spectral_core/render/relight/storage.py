# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that a transport render stores, for the changes that are wanted later: one class per type of storage.

A new storage is one file with a subclass of ``Storage``, listed in ``KINDS`` of ``storages.py``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, counted
from spectral_core.render.mitsuba_scene.paint import unit_luminance
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.spectra.spectrum import FIRST_NM, LAST_NM, Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]


class Storage(ABC):
    """Channels per pixel and light group, and their conversion to linear sRGB."""

    kind: ClassVar[str]
    """Name in files, in the panel and on the command line."""
    keeps_spectra: ClassVar[bool] = True
    """True if the scene is recorded under flat light, so that lights can have new spectra."""
    exr_header: ClassVar[dict[str, Any]] = {}
    """Header of each part beside the transport's attribute."""

    @classmethod
    @abstractmethod
    def choices(cls) -> dict[str, Storage]:
        """The storages of this type for panel and command line, by name."""

    @classmethod
    @abstractmethod
    def of_grid(cls, grid: SpectralGrid | None) -> Storage | None:
        """Storage of this type with that ``grid``, as a file's header states it; None if there is no such one."""

    @property
    @abstractmethod
    def grid(self) -> SpectralGrid | None:
        """Wavelengths of the channels; None if channels are not wavelengths."""

    @abstractmethod
    def channel_names(self) -> tuple[str, ...]:
        """Name of each channel in an EXR part."""

    @abstractmethod
    def measured(self) -> Bands | None:
        """Quantities that the renderer measures beside the picture; None if the picture itself is stored."""

    @abstractmethod
    def rgb_from_channels(self, light: Spectrum) -> Array:
        """Matrix (3, channels): linear sRGB of a pixel recorded under flat light, lit by ``light``.

        ``light``: relative to the flat light, whose value is 1 everywhere. Raises InvalidInputError if the storage
        keeps no spectra.
        """

    @abstractmethod
    def stated_error(self) -> str:
        """Text on the difference of a relit picture from a render."""

    def rgb_as_recorded(self, light: Spectrum | None) -> Array | None:
        """Matrix (3, channels) for a group with its spectrum in the scene; None if that is not known.

        ``light``: the group's spectrum in the scene, with Y = 1 for the brightness of white.
        """
        return None if light is None else self.rgb_from_channels(relative_to_flat(light))

    @property
    def channel_count(self) -> int:
        """Numbers per pixel and light group."""
        return len(self.channel_names())

    def bytes_needed(self, width: int, height: int, groups: int) -> int:
        """Bytes of the stored channels and the coverage, in memory and (uncompressed) on disk."""
        return 4 * width * height * (self.channel_count * groups + 1)

    def describe(self, width: int, height: int, groups: int) -> str:
        """One line to show before rendering: size in memory, and error."""
        size = self.bytes_needed(width, height, groups) / 1e6
        lights = counted(groups, "light group")
        channels = f"{counted(self.channel_count, 'channel')} each"
        stored = f"{size:,.0f}" if size >= 1 else f"{size:.2g}"
        return f"{stored} MB for {lights} at {width}×{height}, {channels}. {self.stated_error()}"


@dataclass(frozen=True)
class MixtureStorage(Storage):
    """Linear sRGB per light group. Exact for every mixture of the scene's lights."""

    kind: ClassVar[str] = "dial"
    keeps_spectra: ClassVar[bool] = False

    @classmethod
    def choices(cls) -> dict[str, Storage]:
        """The only storage of this type."""
        return {cls.kind: cls()}

    @classmethod
    def of_grid(cls, grid: SpectralGrid | None) -> Storage | None:
        """The only storage; it has no wavelengths."""
        return cls() if grid is None else None

    @property
    def grid(self) -> None:
        """None: no wavelengths are stored."""
        return

    def channel_names(self) -> tuple[str, ...]:
        """Linear sRGB."""
        return ("R", "G", "B")

    def measured(self) -> None:
        """None: the picture itself is stored."""
        return

    def rgb_from_channels(self, light: Spectrum) -> Array:
        """Raise InvalidInputError: no spectra are kept."""
        raise InvalidInputError(
            "a 'dial' transport holds no spectra; record again with the storage bands31, bands61, bands121 or exact"
        )

    def rgb_as_recorded(self, light: Spectrum | None) -> Array:
        """The channels are the color."""
        return np.eye(3)

    def stated_error(self) -> str:
        """Text on the difference of a relit picture from a render."""
        return "Any mixture of the lights is exact, up to rounding; they keep their spectra"


def flat_light() -> Illuminant:
    """The light of a transport recording: 1 at every traced wavelength."""
    return Illuminant("flat", SpectralGrid(np.array([float(FIRST_NM), float(LAST_NM)])), np.ones(2))


def relative_to_flat(light: Spectrum) -> Spectrum:
    """The light divided by that of the recording at every wavelength: flat, with Y = 1."""
    return light.scaled(1.0 / _flat_value())


@cache
def _flat_value() -> float:
    """Value of the flat light with Y = 1."""
    return float(unit_luminance(flat_light()).values[0])
