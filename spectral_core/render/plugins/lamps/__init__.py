# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps and environments as Blender defines them."""
