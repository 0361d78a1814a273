# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of Blender as triangles, and their instances."""
