# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a lattice that fill a region: enumeration, anchoring, order."""
