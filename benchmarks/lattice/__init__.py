# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks of lattices: figures of merit, and comparison with other designs."""
