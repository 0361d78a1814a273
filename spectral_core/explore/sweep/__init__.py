# SPDX-License-Identifier: GPL-3.0-or-later
"""Sweeps (R1, R2, R8): parameters, designs, the store that owns the outcomes, and the nodes that compute them."""
