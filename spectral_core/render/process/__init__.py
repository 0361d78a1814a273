# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering in a separate process that stays alive."""
