# SPDX-License-Identifier: GPL-3.0-or-later
"""The word of a brick: all data that an iteration of the march reads about the ray's brick, in 32 bits.

A visible brick has a positive float32: its relative step in voxels. For a rule that skips invisible values, the lower
16 bits hold the upper half of another float32: the *pace*, the least number of voxels along a ray over which the stored
value can change by one. Values far from every visible value are thus passed in few steps, as in sphere tracing (Hart
1996), however fine the brick's step is.

An empty brick has the sign bit set and, in three bits for each octant of ray directions, a level: the size of the cube
of bricks ahead that is empty too (``REACHES``). So a ray leaves a surface in one skip although the surface is close
behind it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import read_only_when_copied

Words = NDArray[np.uint32]
Mask = NDArray[np.bool_]

REACHES = (1, 2, 4, 7, 11, 16, 22, 29)  # bricks: 1 + l(l+1)/2; each at most twice the one before
_EMPTY = np.uint32(1 << 31)


@read_only_when_copied
@dataclass(frozen=True)
class BrickWord:
    """A word on the device, decoded: ``bits`` is an unsigned Dr.Jit array, ``types`` its module."""

    bits: Any
    types: Any

    @staticmethod
    def pack(steps: NDArray[np.float32], paces: NDArray[np.float32] | None, empty: Words, shows: Mask) -> Words:
        """Words of bricks: ``steps`` (and ``paces``) where ``shows``, elsewhere the words ``empty``."""
        words = steps.view(np.uint32)
        if paces is not None:
            # The upper half of a float32 is at most 1/128 below the value, never above: a pace is never too large.
            words = (words & np.uint32(0xFFFF0000)) | (paces.view(np.uint32) >> np.uint32(16))
        return np.where(shows, words, empty)

    @staticmethod
    def pack_empty(shows: Mask) -> Words:
        """Words for bricks (bz, by, bx) as if all were empty: the level l of octant o in bits 3o to 3o + 2.

        Octant bits are 1, 2 and 4 for rays that run down x, y and z. Level l: the cube of ``REACHES[l]`` bricks per
        axis that starts with this brick and reaches ahead is empty (outside the grid counts as empty).
        """
        words = np.full(shows.shape, _EMPTY, np.uint32)
        for octant in range(8):
            # Cubes grow level by level: a larger empty cube is made of overlapping smaller ones, so three passes per
            # level suffice.
            empty, levels = (~shows).view(np.uint8), np.zeros(shows.shape, np.uint8)
            for size, larger in itertools.pairwise(REACHES):
                for axis in range(3):
                    empty = _and_ahead(empty, larger - size, 2 - axis, bool(octant >> axis & 1))
                if not empty.any():
                    break
                levels += empty
            words |= levels.astype(np.uint32) << np.uint32(3 * octant)
        return words

    @staticmethod
    def shown(words: Words) -> Mask:
        """True for NumPy's ``words`` of visible bricks."""
        return words < _EMPTY

    @staticmethod
    def paces_of(words: Words) -> NDArray[np.float32]:
        """Paces in NumPy's ``words`` of visible bricks."""
        return (words << np.uint32(16)).view(np.float32)

    @staticmethod
    def level_of(word: int, octant: int) -> int:
        """The level of one empty brick in one octant."""
        return int(word) >> (3 * octant) & 7

    @property
    def shows(self) -> Any:
        """True if the brick is visible."""
        return self.bits < int(_EMPTY)

    @property
    def step(self) -> Any:
        """Relative step in voxels; zero or negative if the brick is empty. A pace makes it up to 1/128 longer."""
        import drjit as dr

        return dr.reinterpret_array(self.types.Float, self.bits)

    @property
    def pace(self) -> Any:
        """Least number of voxels along a ray in this brick over which the stored value changes by one."""
        import drjit as dr

        return dr.reinterpret_array(self.types.Float, self.bits << 16)

    def reach(self, octant_shift: Any) -> Any:
        """Bricks per axis of the empty cube ahead, as a float; 1 for a visible brick."""
        import drjit as dr

        bits = dr.select(self.shows, self.types.UInt32(0), (self.bits >> octant_shift) & 7)
        # 1 + l(l + 1)/2 as a formula: a table of eight entries would cost a memory access.
        level = self.types.Float(bits)
        return dr.fma(level * 0.5, level + 1.0, 1.0)


def _and_ahead(empty: NDArray[np.uint8], shift: int, axis: int, down: bool) -> NDArray[np.uint8]:
    """``empty`` combined with itself ``shift`` bricks further along ``axis`` (back, if ``down``); outside counts as
    empty.
    """
    both = empty.copy()
    if shift < empty.shape[axis]:
        near, far = [slice(None)] * 3, [slice(None)] * 3
        near[axis], far[axis] = slice(None, -shift), slice(shift, None)
        # For a ray in negative direction, the bricks ahead have smaller indices.
        here, there = (far, near) if down else (near, far)
        np.bitwise_and(empty[tuple(here)], empty[tuple(there)], out=both[tuple(here)])
    return both
