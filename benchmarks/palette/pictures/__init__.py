# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of palettes and their errors."""
