# SPDX-License-Identifier: GPL-3.0-or-later
"""Sweeps: parameters, designs, the store that owns the outcomes, and the nodes that compute them."""
