# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras, panoramas and lens apertures: from a position in the picture to a ray."""
