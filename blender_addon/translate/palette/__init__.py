# SPDX-License-Identifier: GPL-3.0-or-later
"""The palette: its table as the core's problem and back, and solved spectra applied to the materials and lights of a
scene.
"""
