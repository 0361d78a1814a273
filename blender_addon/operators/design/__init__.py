# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist asks of design beyond one table: textures, possible colors, recipes, alternatives, paints."""
