# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks of 3D views: latency, stalls, endurance, comparison with Cycles."""
