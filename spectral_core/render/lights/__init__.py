# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a scene as tables: choice of a light for a surface, its probability, and its illumination."""
