# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs, requests and sweeps that the benchmarks of exploration try."""
