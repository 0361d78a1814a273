# SPDX-License-Identifier: GPL-3.0-or-later
"""From a loaded scene to pixels: rays, samples, wavelengths, accumulation."""
