# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks of the program as a whole: faults, damaged files, mutation, set-up, recipes."""
