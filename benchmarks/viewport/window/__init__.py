# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts that run in a Blender with a window, and the launch of it."""
