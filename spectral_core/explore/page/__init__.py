# SPDX-License-Identifier: GPL-3.0-or-later
"""The scatter-plot matrix: one self-contained page, its live server, and static figures."""
