# SPDX-License-Identifier: GPL-3.0-or-later
"""From Blender's evaluated scene to ``spectral_core.scene.Scene``: the only place that knows both.

Nothing here writes to Blender, so it may run on the thread that a render runs on. What is not understood becomes the
closest thing that is, and a Note that names it, once.
"""
