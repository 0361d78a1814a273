# SPDX-License-Identifier: GPL-3.0-or-later
"""The path integrator for Blender's scenes: its state, its limits, its random numbers."""
