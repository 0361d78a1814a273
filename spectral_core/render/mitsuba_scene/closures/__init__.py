# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures of the scene as closures of the kernel: what each reads, and the tables that it needs."""
