# SPDX-License-Identifier: GPL-3.0-or-later
"""The march of a ray through a volume: steps, tables, quadrature."""
