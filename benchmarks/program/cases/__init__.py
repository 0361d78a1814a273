# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged files, writers of files, and the lines that a change touches."""
