# SPDX-License-Identifier: GPL-3.0-or-later
"""Feature scenes of shader nodes, textures and materials."""
