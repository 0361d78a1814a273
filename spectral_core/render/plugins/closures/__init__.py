# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures that Mitsuba lacks, as Blender defines them."""
