# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra, observers, colors, the shipped catalogue and the files that hold spectra."""
