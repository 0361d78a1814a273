# SPDX-License-Identifier: GPL-3.0-or-later
"""From a place in the picture to a ray: cameras, panoramas, lens openings."""
