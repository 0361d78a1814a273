# SPDX-License-Identifier: GPL-3.0-or-later
"""Designs, regions and integrands that the benchmarks of lattices measure."""
