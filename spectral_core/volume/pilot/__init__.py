# SPDX-License-Identifier: GPL-3.0-or-later
"""Pilot rays: they measure the error of every stepping before the picture."""
