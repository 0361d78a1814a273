# SPDX-License-Identifier: GPL-3.0-or-later
"""From the radiance of a path at four wavelengths to the colors and the bands of a picture."""
