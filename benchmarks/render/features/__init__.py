# SPDX-License-Identifier: GPL-3.0-or-later
"""Single-feature scenes, by name: each is the standard stage (a ball on a plane) with one change."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.render.features.stage import Stage

FAMILIES = ("light.lamps", "light.world", "shading.closures", "shading.closure_sockets", "shading.color_nodes",
            "shading.textures", "shading.inputs", "shading.images", "pictures.camera", "pictures.film",
            "objects.objects", "shading.hair", "shading.normals", "media.volumes", "media.grids", "media.overlaps",
            "shading.mixed", "light.mixed_light", "shading.combined", "shading.further", "shading.further_inputs",
            "light.lamp_trees", "objects.shown", "light.world_trees", "objects.unusual_objects",
            "shading.unusual_nodes", "light.unusual_light", "pictures.unusual_more", "pictures.unusual_settings",
            "objects.unusual_instances", "shading.extremes", "objects.strange", "objects.drawn", "objects.grown",
            "objects.placed", "objects.odd_settings")  # fmt: skip


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
        importlib.import_module(f"benchmarks.render.features.{family}")
    return dict(_found)
