# SPDX-License-Identifier: GPL-3.0-or-later
"""From the two convex sides to the whole palette: rounds, designed lights, and the criteria to stop."""
