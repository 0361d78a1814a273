# SPDX-License-Identifier: GPL-3.0-or-later
"""Explanations that need new solves: for missed cells whose multipliers identify no other cell."""
