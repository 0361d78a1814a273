# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that a material has beside its nodes: a spectrum, and fluorescent dyes."""
