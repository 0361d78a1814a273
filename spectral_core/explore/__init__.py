# SPDX-License-Identifier: GPL-3.0-or-later
"""Sweeps of parameters, their features and pages, and the mixing board."""
