# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds on light from a scene's data: largest values, repeated reflection, small objects in view."""
