# SPDX-License-Identifier: GPL-3.0-or-later
"""Sweeps (R1, R2, R8): what is swept, where it is sampled, the store that owns the outcomes, and who computes them."""
