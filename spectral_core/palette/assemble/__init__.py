# SPDX-License-Identifier: GPL-3.0-or-later
"""From the cells of a palette to stacked quadratic programs."""
