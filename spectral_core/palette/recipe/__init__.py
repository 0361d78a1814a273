# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra that can be made: drive levels of LED lamps, and amounts of paints, inks and filters."""
