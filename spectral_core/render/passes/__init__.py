# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes beside the picture: what camera rays see, shares of the light, cryptomattes."""
