# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure error against time on a few pixels and predict both for the whole picture."""
