# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes and counts of the benchmarks of 3D views."""
