# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral textures from the panel to the core: the project, and the contrast that the lights allow."""
