# SPDX-License-Identifier: GPL-3.0-or-later
"""Participating media for Mitsuba: rows of coefficients, grids, and where media are."""
