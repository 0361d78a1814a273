# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of design beyond the table: textures, possible colors, recipes, alternatives, paints."""
