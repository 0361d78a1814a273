# SPDX-License-Identifier: GPL-3.0-or-later
"""Tints, paint mixtures and fluorescent materials."""
