# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of a picture, with the names of Cycles."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from spectral_core.checks import require_declared, require_range
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.scene.shading.program import Computed

LOBES = ("Diffuse", "Glossy", "Transmission")
"""Lobes of the first surface; light of a medium before it is Volume."""
DATA_PASSES = {
    "Depth": 1, "Mist": 1, "Position": 3, "Normal": 3, "UV": 3, "Object Index": 1, "Material Index": 1,
    "Diffuse Color": 3, "Glossy Color": 3, "Transmission Color": 3, "Denoising Normal": 3, "Denoising Albedo": 3,
    "Denoising Depth": 1,
}  # fmt: skip
"""Passes of the first hit of camera rays, by name, with the number of channels."""
DENOISING = ("Denoising Normal", "Denoising Albedo", "Denoising Depth")
"""Passes of the first rough surfaces, which rays reach over mirrors and through glass."""
LIGHT_PASSES = (
    *(f"{lobe} {order}" for lobe in (*LOBES, "Volume") for order in ("Direct", "Indirect")), "Emission", "Environment",
)  # fmt: skip
"""Shares of the light of the picture, three channels each."""
CRYPTOMATTES = ("CryptoObject", "CryptoMaterial", "CryptoAsset")
OTHER_PASSES = {"Debug Sample Count": 1, "Noisy Image": 4}
PASSES = (*DATA_PASSES, *LIGHT_PASSES, *CRYPTOMATTES, *OTHER_PASSES)
"""Every pass except AOVs and light groups, whose names are chosen by the artist."""
MOST_LEVELS = 16
GROUP_PREFIX = "Combined_"
"""Prefix of the name of a light group."""


@dataclass(frozen=True, slots=True)
class Mist:
    """Start of the mist, distance over which it becomes full, and its falloff: Blender's world settings."""

    start: float = 5.0
    depth: float = 25.0
    falloff: Literal["QUADRATIC", "LINEAR", "INVERSE_QUADRATIC"] = "QUADRATIC"

    def __post_init__(self) -> None:
        require_declared(self)


@dataclass(frozen=True, slots=True)
class Passes:
    """Passes to render beside the picture; only these are computed.

    ``names``: of ``PASSES``. ``aovs``: name and "VALUE" or "COLOR" of each output of materials. ``light_groups``: names
    of groups with a pass of their own. ``alpha_threshold``: surfaces of smaller coverage count as transparent.
    ``levels``: ids per pixel in a cryptomatte. ``of_world``: values of AOVs, by name, where a ray meets the
    environment, as three numbers of a program that may read the directions of a ``DrawnPattern``.
    """

    names: tuple[str, ...] = ()
    aovs: tuple[tuple[str, str], ...] = ()
    light_groups: tuple[str, ...] = ()
    mist: Mist = field(default_factory=Mist)
    alpha_threshold: float = 0.5
    levels: int = 6
    of_world: tuple[tuple[str, Computed], ...] = ()

    def __post_init__(self) -> None:
        require_declared(self)
        for name in self.names:
            if name not in PASSES:
                raise UnknownNameError.among("pass", name, PASSES)
        if not all(isinstance(each, tuple | list) and len(each) == 2 for each in self.aovs):
            raise InvalidInputError(f"aovs are {self.aovs}; expected pairs of a name and 'VALUE' or 'COLOR'")
        for name, kind in self.aovs:
            if kind not in ("VALUE", "COLOR"):
                raise InvalidInputError(f"AOV {name!r} is of kind {kind!r}; expected 'VALUE' or 'COLOR'")
        require_range("levels of a cryptomatte", self.levels, 2, MOST_LEVELS)
        require_range("the alpha threshold of passes", self.alpha_threshold, 0.0, 1.0)

    @property
    def light(self) -> tuple[str, ...]:
        """Names of the requested passes that contain shares of the light."""
        return tuple(name for name in LIGHT_PASSES if name in self.names)

    @property
    def data(self) -> tuple[str, ...]:
        """Names of the passes of first hits: the requested ones, and the colors by which light passes are divided."""
        lobes = {name.partition(" ")[0] for name in self.light} & set(LOBES)
        wanted = set(self.names) | {f"{lobe} Color" for lobe in lobes}
        return tuple(name for name in DATA_PASSES if name in wanted and name not in DENOISING)

    @property
    def denoising(self) -> tuple[str, ...]:
        """Names of the requested passes for a denoiser."""
        return tuple(name for name in DENOISING if name in self.names)

    @property
    def cryptomattes(self) -> tuple[str, ...]:
        """Names of the requested cryptomattes."""
        return tuple(name for name in CRYPTOMATTES if name in self.names)
