# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a convex region in the unit cube, batch after batch."""
