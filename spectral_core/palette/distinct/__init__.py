# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes whose colors are as distinct as possible under chosen lights."""
