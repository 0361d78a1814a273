# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels. They show stored properties and never solve, read files or change data."""
