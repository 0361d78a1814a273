# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks of recordings: error, time and memory of light mixed later."""
