# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks of node trees: their cost, hard cases, and values against Cycles."""
