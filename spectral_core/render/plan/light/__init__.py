# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds on light from a scene's data: largest values, light that is reflected again and again, small objects in view."""
