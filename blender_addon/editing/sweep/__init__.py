# SPDX-License-Identifier: GPL-3.0-or-later
"""Sweeps of the open file: settings, documents, runs in the background, and points in the scene."""
