# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of a material by what they compute: colors, coordinates, textures, skies."""
