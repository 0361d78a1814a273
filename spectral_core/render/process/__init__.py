# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering in a process of its own, which stays."""
