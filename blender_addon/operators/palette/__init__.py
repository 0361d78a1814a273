# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the palette: its table, its files, solving, applying, and taking it from the scene."""
