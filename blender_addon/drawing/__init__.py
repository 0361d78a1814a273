# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of spectra and colors: pixels computed without Blender, shown as icons in panels and over the viewport."""
