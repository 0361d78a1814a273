# SPDX-License-Identifier: GPL-3.0-or-later
"""Owen-scrambled Sobol points in padded pairs, the random numbers of every decision of a path.

Burley 2020, "Practical hash-based Owen scrambling" (JCGT 9(4)): each pair of dimensions takes the two-dimensional
Sobol sequence with its own shuffled order and scrambled digits. Any power of two of consecutive samples is stratified
in every pair, which leaves far less noise than independent numbers, and a point depends on nothing but its seed, index
and dimension. The functions take NumPy or Dr.Jit arrays of 32-bit unsigned integers.
"""

from __future__ import annotations

from typing import Any


def reversed_bits(value: Any) -> Any:
    """The 32 bits of ``value`` in reverse order."""
    value = ((value >> 1) & 0x55555555) | ((value & 0x55555555) << 1)
    value = ((value >> 2) & 0x33333333) | ((value & 0x33333333) << 2)
    value = ((value >> 4) & 0x0F0F0F0F) | ((value & 0x0F0F0F0F) << 4)
    value = ((value >> 8) & 0x00FF00FF) | ((value & 0x00FF00FF) << 8)
    return (value >> 16) | (value << 16)


def hashed(value: Any) -> Any:
    """A well-mixed 32-bit number of another (the lowbias32 mixer of Wellons 2018)."""
    value = (value ^ (value >> 16)) * 0x7FEB352D
    value = (value ^ (value >> 15)) * 0x846CA68B
    return value ^ (value >> 16)


def _owen_reversed(bits: Any, seed: Any) -> Any:
    """Scramble digits of a number whose bits are already reversed (Laine and Karras 2011, with Burley's constants)."""
    # Each step carries only from lower to higher bits of the reversed number: a digit is scrambled by the more
    # significant ones alone, as Owen scrambling requires.
    bits = bits ^ (bits * 0x3D20ADEA)
    bits = bits + seed
    bits = bits * ((seed >> 16) | 1)
    bits = bits ^ (bits * 0x05526C56)
    return bits ^ (bits * 0x53A22864)


def first_sobol(index: Any) -> Any:
    """First Sobol dimension, as 32-bit fraction: the radical inverse."""
    return reversed_bits(index)


def second_sobol(index: Any) -> Any:
    """Second Sobol dimension, as 32-bit fraction: Pascal's matrix modulo 2, by halves."""
    index = index ^ ((index >> 16) & 0x0000FFFF)
    index = index ^ ((index >> 8) & 0x00FF00FF)
    index = index ^ ((index >> 4) & 0x0F0F0F0F)
    index = index ^ ((index >> 2) & 0x33333333)
    index = index ^ ((index >> 1) & 0x55555555)
    return reversed_bits(index)


def pair(index: Any, seed: Any) -> tuple[Any, Any]:
    """Point ``index`` of the pair ``seed``, two 32-bit fractions."""
    # Three independent scrambles: of the order of the points and of the digits of either coordinate.
    order, first, second = hashed(seed), hashed(seed ^ 0x55555555), hashed(seed ^ 0x33333333)
    shuffled = reversed_bits(_owen_reversed(reversed_bits(index), order))
    # a fraction is scrambled from its most significant digit on, which a reversal puts first
    x = reversed_bits(_owen_reversed(reversed_bits(first_sobol(shuffled)), first))
    y = reversed_bits(_owen_reversed(reversed_bits(second_sobol(shuffled)), second))
    return x, y
