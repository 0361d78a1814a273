# SPDX-License-Identifier: GPL-3.0-or-later
"""Cryptomattes: names at a pixel with their coverage (Friedman and Jones 2015, specification 1.2).

The id of a name is its 32-bit MurmurHash3 read as a float. A pixel keeps the names of largest coverage.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]


def murmur_hash(text: str, seed: int = 0) -> int:
    """MurmurHash3, 32 bits, of a text in UTF-8."""
    data, value = text.encode(), seed
    for start in range(0, len(data) - len(data) % 4, 4):
        value ^= _scrambled(int.from_bytes(data[start : start + 4], "little"))
        value = (_rotated(value, 13) * 5 + 0xE6546B64) & 0xFFFFFFFF
    rest = data[len(data) - len(data) % 4 :]
    if rest:
        value ^= _scrambled(int.from_bytes(rest, "little"))
    value ^= len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        value = ((value ^ (value >> shift)) * factor) & 0xFFFFFFFF
    return value ^ (value >> 16)


def _scrambled(word: int) -> int:
    return (_rotated((word * 0xCC9E2D51) & 0xFFFFFFFF, 15) * 0x1B873593) & 0xFFFFFFFF


def _rotated(word: int, bits: int) -> int:
    return ((word << bits) | (word >> (32 - bits))) & 0xFFFFFFFF


def id_of(name: str) -> np.float32:
    """Id of a name: its hash as a float that is normal and finite."""
    word = murmur_hash(name)
    exponent = min(max(word >> 23 & 255, 1), 254)
    bits = (exponent << 23) | (word & 0x007FFFFF) | (word & 0x80000000)
    return np.frombuffer(np.uint32(bits).tobytes(), np.float32)[0]


def header(layer: str, name: str, subjects: Iterable[str]) -> dict[str, str]:
    """Header of a cryptomatte ``name`` of a layer: the hash function, and the ids of all names."""
    full = f"{layer}.{name}"
    key = f"cryptomatte/{murmur_hash(full):08x}"[:19]
    names = {subject: f"{murmur_hash_float_bits(subject):08x}" for subject in sorted(set(subjects))}
    return {
        f"{key}/name": full,
        f"{key}/hash": "MurmurHash3_32",
        f"{key}/conversion": "uint32_to_float32",
        f"{key}/manifest": json.dumps(names, ensure_ascii=False, separators=(",", ":")),
    }


def murmur_hash_float_bits(name: str) -> int:
    """The bits of a name's id."""
    return int(np.frombuffer(id_of(name).tobytes(), np.uint32)[0])


class Slots:
    """Names and weights of pixels, in registers of a kernel: ``count`` of each, the rest is dropped."""

    def __init__(self, mi: Any, dr: Any, count: int) -> None:
        self._mi, self._dr, self.count = mi, dr, count

    def empty(self, lanes: int) -> list[Any]:
        """State without any name: numbers of names from 1 (0 for a free slot), then weights."""
        mi, dr = self._mi, self._dr
        names = [dr.opaque(mi.UInt32, 0, lanes) for _ in range(self.count)]
        return [*names, *(dr.opaque(mi.Float, 0.0, lanes) for _ in range(self.count))]

    def add(self, state: list[Any], name: Any, weight: Any, active: Any) -> list[Any]:
        """The state with a name's weight added, in the slot of that name or in the first free one."""
        dr = self._dr
        names, weights = list(state[: self.count]), list(state[self.count :])
        open_ = active & (name != 0) & (weight > 0.0)
        for k in range(self.count):
            mine = open_ & ((names[k] == name) | (names[k] == 0))
            names[k] = dr.select(mine, name, names[k])
            weights[k] = dr.select(mine, weights[k] + weight, weights[k])
            open_ &= ~mine
        return [*names, *weights]


def layers(numbers: NDArray[np.uint32], weights: Array, ids: Array) -> list[Array]:
    """Pictures (n, 4) of two names each: id and weight, id and weight; the largest weights first.

    ``numbers``, ``weights``: (n, count) of ``Slots``; ``ids``: by number.
    """
    order = np.argsort(-weights, axis=1, kind="stable")
    weights = np.take_along_axis(weights, order, axis=1)
    found = ids[np.take_along_axis(numbers, order, axis=1)]
    found = np.where(weights > 0, found, 0.0)
    return [
        np.stack([found[:, k], weights[:, k], found[:, k + 1], weights[:, k + 1]], axis=1).astype(np.float32)
        for k in range(0, weights.shape[1], 2)
    ]
