# SPDX-License-Identifier: GPL-3.0-or-later
"""From Blender's evaluated scene to ``spectral_core.scene.Scene``: the only package that uses both.

Nothing here writes to Blender, so it may run on the thread of a render. An unsupported feature is replaced by the
closest supported one, and a Note names it once.
"""
