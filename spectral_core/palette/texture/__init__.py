# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral textures: one surface that shows a different picture under each light."""
