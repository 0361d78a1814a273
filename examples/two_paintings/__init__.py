# SPDX-License-Identifier: GPL-3.0-or-later
"""Two white lights, two paintings: a gallery wall whose picture changes when one white lamp replaces another."""
