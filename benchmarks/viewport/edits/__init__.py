# SPDX-License-Identifier: GPL-3.0-or-later
"""Random edits of a Blender file, and the session that makes them."""
