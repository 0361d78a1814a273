# SPDX-License-Identifier: GPL-3.0-or-later
"""From Blender's evaluated scene to ``spectral_core.scene.Scene``: the only place that knows both.

Nothing here writes to Blender, so it may run on the thread that a render runs on. A feature that is not
supported becomes the closest one that is, and a Note names it once.
"""
