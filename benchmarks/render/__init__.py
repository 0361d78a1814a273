# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks of rendering: closed forms, Cycles, noise, predicted cost, planned effects."""
