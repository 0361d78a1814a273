# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes: fields, transfer functions, the march and its plan, files."""
