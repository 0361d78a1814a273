# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks of volumes: step, error, time, comparison with other programs."""
