# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields, grids and tables of the march as arrays of Dr.Jit."""
