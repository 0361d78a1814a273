# SPDX-License-Identifier: GPL-3.0-or-later
"""A browser and a reader of Cinema folders that share no code with ``spectral_core.explore``."""
