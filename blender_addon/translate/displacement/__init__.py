# SPDX-License-Identifier: GPL-3.0-or-later
"""Displacement of meshes by their materials."""
