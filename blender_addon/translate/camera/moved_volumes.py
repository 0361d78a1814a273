# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur of volumes with transfer functions: their objects move, their data are those of the frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Scene
from spectral_core.scene.motion import MovedVolume

from ..context import Translation
from ..objects import collect
from .between import around, between
from .identities import Owners

Places = dict[str, tuple[Owners, NDArray[np.float64]]]
"""By the name of a volume: its object and what shows it, and its (4, 4) world_from_object."""


def places_in_frame(depsgraph: Any, scene: Scene) -> Places:
    """The places of the volumes of a scene in the frame that ``depsgraph`` shows."""
    return collect(Translation.of(depsgraph, bpy.data)).volume_places if scene.volumes else {}


@dataclass(frozen=True, eq=False)
class VolumesInMotion:
    """Volumes while the shutter is open. ``frame``: their places in the frame, ``instants``: at evenly spaced instants.

    ``parts``: number of parts of each object's motion and deformation. A volume that an instant lacks does not move.
    """

    frame: Places
    instants: list[Places]
    parts: Mapping[Owners, tuple[int, int]]

    def any_moves(self) -> bool:
        """True if a volume that may move is elsewhere than in the frame at any instant."""
        return any(
            self._parts(name) and not np.array_equal(each[name][1], home)
            for name, (_, home) in self.frame.items()
            for each in self.instants
        )

    def at(self, scene: Scene, time: float) -> tuple[MovedVolume, ...]:
        """The volumes that are elsewhere at a time, in shares of the shutter's open time; what does not move is where
        it is in the middle of that time, as in Cycles.
        """
        moved = []
        for volume in scene.volumes:
            home = self.frame[volume.name][1] if volume.name in self.frame else None
            if home is None or not all(volume.name in each for each in self.instants) or not np.linalg.det(home):
                continue
            one, other, share = around(self.instants, self._parts(volume.name), time)
            placed = between(one[volume.name][1], other[volume.name][1], share)
            if not np.array_equal(placed, home):
                moved.append(MovedVolume(volume.name, placed @ np.linalg.inv(home) @ volume.world_from_index))
        return tuple(moved)

    def _parts(self, name: str) -> int:
        """Number of parts of a volume's motion, 0 for one that does not move."""
        if not all(name in each for each in self.instants):
            return 0
        return self.parts.get(self.frame[name][0], (2, 2))[0]
