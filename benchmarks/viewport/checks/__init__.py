# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of the pictures of 3D views."""
