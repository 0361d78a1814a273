# SPDX-License-Identifier: GPL-3.0-or-later
"""What shines in a scene, as tables: which light a surface asks, how likely that was, and what it gets."""
