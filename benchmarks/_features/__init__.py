# SPDX-License-Identifier: GPL-3.0-or-later
"""Single-feature scenes, by name: each is the standard stage (a ball on a plane) with one change."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks._features.stage import Stage

FAMILIES = ("lamps", "world", "closures", "closure_sockets", "color_nodes", "textures", "inputs", "images", "camera",
            "film", "objects", "hair", "normals", "volumes", "grids", "overlaps", "mixed", "mixed_light", "combined",
            "further", "further_inputs", "lamp_trees", "shown", "world_trees", "unusual_objects", "unusual_nodes",
            "unusual_light", "unusual_more", "unusual_settings",
            "unusual_instances",
            "extremes", "strange", "drawn", "grown", "placed", "odd_settings")  # fmt: skip


@dataclass(frozen=True)
class Feature:
    """One scene. ``build`` changes the stage; ``samples``: factor on the samples where the feature is noisy."""

    name: str
    build: Callable[[Stage], object]
    samples: int = 1


_found: dict[str, Feature] = {}


def feature(name: str, build: Callable[[Stage], object], samples: int = 1) -> None:
    """Register a scene as ``family/name``; every name must be new."""
    if name in _found:
        raise ValueError(f"two feature scenes are named {name!r}")
    _found[name] = Feature(name, build, samples)


def all_features() -> dict[str, Feature]:
    """Every scene by name, in the order of the families."""
    for family in FAMILIES:
        importlib.import_module(f"benchmarks._features.{family}")
    return dict(_found)
