# SPDX-License-Identifier: GPL-3.0-or-later
"""Independent checks of a palette's answer: they share no code with ``spectral_core.palette``."""
