# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.spectral.palette``: the table, its cells, and the answers beside its solution."""
