# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation for a viewport: its view, its light, and parts that are kept between edits."""
