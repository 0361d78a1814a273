# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks of sweeps, their page and the mixing board."""
