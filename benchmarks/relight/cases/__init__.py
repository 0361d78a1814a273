# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that the benchmarks of recordings record."""
