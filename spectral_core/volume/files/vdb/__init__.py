# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB files without OpenVDB's own module: structure, grids, reading, writing."""
