# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of merit of lattices and point sets."""
