# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds on light from a scene's data: largest values, and what surfaces reflect again and again."""
