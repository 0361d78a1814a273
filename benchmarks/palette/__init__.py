# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks of the palette: accuracy, optimality, conflicts, live edits."""
