# SPDX-License-Identifier: GPL-3.0-or-later
"""Which passes a picture comes with, named as Cycles names them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError, UnknownNameError

LOBES = ("Diffuse", "Glossy", "Transmission")
"""What the first surface does with light; a medium before it is Volume."""
DATA_PASSES = {
    "Depth": 1, "Mist": 1, "Position": 3, "Normal": 3, "UV": 3, "Object Index": 1, "Material Index": 1,
    "Diffuse Color": 3, "Glossy Color": 3, "Transmission Color": 3, "Denoising Normal": 3, "Denoising Albedo": 3,
    "Denoising Depth": 1,
}  # fmt: skip
"""What camera rays see, by name, with the number of channels."""
LIGHT_PASSES = (
    *(f"{lobe} {order}" for lobe in (*LOBES, "Volume") for order in ("Direct", "Indirect")), "Emission", "Environment",
)  # fmt: skip
"""Shares of the light of the picture, three channels each."""
CRYPTOMATTES = ("CryptoObject", "CryptoMaterial", "CryptoAsset")
OTHER_PASSES = {"Debug Sample Count": 1, "Noisy Image": 4}
PASSES = (*DATA_PASSES, *LIGHT_PASSES, *CRYPTOMATTES, *OTHER_PASSES)
"""Every pass but AOVs and light groups, which have names of their own."""
MOST_LEVELS = 16
GROUP_PREFIX = "Combined_"
"""Before the name of a light group."""


@dataclass(frozen=True, slots=True)
class Mist:
    """Where mist begins, the distance over which it becomes full, and how: Blender's world settings."""

    start: float = 5.0
    depth: float = 25.0
    falloff: Literal["QUADRATIC", "LINEAR", "INVERSE_QUADRATIC"] = "QUADRATIC"


@dataclass(frozen=True, slots=True)
class Passes:
    """Passes to make beside the picture; only these are computed.

    ``names``: of ``PASSES``. ``aovs``: name and "VALUE" or "COLOR" of each output that materials write to.
    ``light_groups``: names of groups whose light is wanted by itself. ``alpha_threshold``: surfaces that cover less of
    what lies behind are looked through. ``levels``: ids that a cryptomatte keeps per pixel.
    """

    names: tuple[str, ...] = ()
    aovs: tuple[tuple[str, str], ...] = ()
    light_groups: tuple[str, ...] = ()
    mist: Mist = field(default_factory=Mist)
    alpha_threshold: float = 0.5
    levels: int = 6

    def __post_init__(self) -> None:
        for name in self.names:
            if name not in PASSES:
                raise UnknownNameError.among("pass", name, PASSES)
        for name, kind in self.aovs:
            if kind not in ("VALUE", "COLOR"):
                raise InvalidInputError(f"AOV {name!r} is of kind {kind!r}; expected 'VALUE' or 'COLOR'")
        require_range("levels of a cryptomatte", self.levels, 2, MOST_LEVELS)
        require_range("the alpha threshold of passes", self.alpha_threshold, 0.0, 1.0)

    @property
    def light(self) -> tuple[str, ...]:
        """Names of the wanted passes that hold shares of the light."""
        return tuple(name for name in LIGHT_PASSES if name in self.names)

    @property
    def data(self) -> tuple[str, ...]:
        """Names of what camera rays must see: what is wanted, and the colors that light passes are divided by."""
        lobes = {name.partition(" ")[0] for name in self.light} & set(LOBES)
        wanted = set(self.names) | {f"{lobe} Color" for lobe in lobes}
        if "Denoising Albedo" in wanted:
            wanted |= {f"{lobe} Color" for lobe in LOBES}
        return tuple(name for name in DATA_PASSES if name in wanted)

    @property
    def cryptomattes(self) -> tuple[str, ...]:
        """Names of the wanted cryptomattes."""
        return tuple(name for name in CRYPTOMATTES if name in self.names)
