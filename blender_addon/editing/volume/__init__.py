# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes that are imported: read and written as OpenVDB on a thread, then added to the scene."""
