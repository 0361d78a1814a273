# SPDX-License-Identifier: GPL-3.0-or-later
"""Media in objects and around them: free flight, scattering, emission, and media that vary on a grid."""
