# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material itself carries beside its nodes: a spectrum, and fluorescent dyes."""
