# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes and measured data that the benchmarks of the palette solve."""
