# SPDX-License-Identifier: GPL-3.0-or-later
"""The project of a sweep: the contents of project.json, which are its parameters, design, computation and views."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field
from typing import Any

from spectral_core.errors import FileFormatError
from spectral_core.explore.sweep.designs import Design
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.region import RegionOfInterest

FORMAT, VERSION = "spectral-scene sweep project", 1


@dataclass(slots=True)
class Project:
    """Contents of project.json, beside the points."""

    space: Space
    region: RegionOfInterest
    design: Design
    compute: dict[str, Any] = field(default_factory=dict)
    fingerprint: str = ""
    seed: int = 0
    store_id: str = field(default_factory=lambda: secrets.token_hex(16))
    expressions: dict[str, str] = field(default_factory=dict)
    regions: dict[str, dict[str, Any]] = field(default_factory=dict)
    views: dict[str, Any] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "id": self.store_id,
            "parameters": [parameter.to_dict() for parameter in self.space.parameters],
            "region": self.region.to_dict(),
            "design": self.design.to_dict(),
            "compute": self.compute,
            "fingerprint": self.fingerprint,
            "seed": self.seed,
            "expressions": self.expressions,
            "regions": self.regions,
            "views": self.views,
            "units": self.units,
            "environment": self.environment,
        }

    @classmethod
    def from_dict(cls, plain: Any, name: str) -> Project:
        """The project of a file; FileFormatError if it is none."""
        if not isinstance(plain, dict) or plain.get("format") != FORMAT:
            raise FileFormatError(f"{name} is no project of a sweep")
        if plain.get("version") != VERSION:
            raise FileFormatError(f"{name} has version {plain.get('version')!r}; this program reads version {VERSION}")
        try:
            space = Space(tuple(Parameter.from_dict(each) for each in plain["parameters"]))
            return cls(
                space,
                RegionOfInterest.from_dict(plain["region"]),
                Design.from_dict(plain["design"]),
                dict(plain["compute"]),
                str(plain["fingerprint"]),
                int(plain["seed"]),
                str(plain["id"]),
                *(dict(plain[part]) for part in ("expressions", "regions", "views", "units", "environment")),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise FileFormatError(f"{name} is incomplete: {error!r}") from error


def present_environment() -> dict[str, str]:
    """Versions of the programs and the machine that make a sweep."""
    import platform

    import numpy
    import scipy

    from spectral_core import __version__

    return {
        "spectral_scene": __version__, "python": platform.python_version(), "numpy": numpy.__version__,
        "scipy": scipy.__version__, "machine": platform.machine(), "system": platform.system(),
    }  # fmt: skip
