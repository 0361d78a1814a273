# SPDX-License-Identifier: GPL-3.0-or-later
"""Finished scenes, as scripts that a reader can learn from, and palettes to begin with."""
