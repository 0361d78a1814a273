# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks of volumes: transfer functions of the core, and their properties on a Volume data-block."""
