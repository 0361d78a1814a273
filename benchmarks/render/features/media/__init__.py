# SPDX-License-Identifier: GPL-3.0-or-later
"""Feature scenes of media and grids."""
