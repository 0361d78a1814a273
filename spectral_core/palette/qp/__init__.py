# SPDX-License-Identifier: GPL-3.0-or-later
"""Engines for the convex quadratic programs of a palette, and the check that every answer must pass."""
