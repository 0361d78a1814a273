# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed forms, reference renders and comparisons for the benchmarks of rendering."""
