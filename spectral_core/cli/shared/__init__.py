# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers that several commands share; this folder holds no command."""
