# SPDX-License-Identifier: GPL-3.0-or-later
"""From a lattice and a region to points in progressive order. Read the modules in this order.

1. ``regions``: regions to fill, {x : A x <= b} within at most one ball.
2. ``anchoring``: the region relative to a point inside it. Its gauge says how far it must grow to reach a point, and an
   ellipsoid around it (``cap_ellipsoid`` where a ball is cut) is the metric in which it is round.
3. ``enumeration``: all lattice points within a gauge, coordinate by coordinate in that metric.
4. ``frame``: a lattice placed in space. A point's coordinates follow from its address alone, rounding included, at
   every level of refinement.
5. ``filling``: exactly m points, by ranking points by gauge and scaling the frame between the m-th and the next.
6. ``progressive``: the points in an order whose every prefix is even, and a refinement that moves no point.

The rest of the program calls ``progressive_fill(region, count)`` and ``ProgressivePoints.refine``.
"""
