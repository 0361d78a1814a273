# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures: noise, cells, waves and other patterns."""
