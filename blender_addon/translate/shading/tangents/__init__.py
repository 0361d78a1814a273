# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions along the surface, and the nodes that use them."""
