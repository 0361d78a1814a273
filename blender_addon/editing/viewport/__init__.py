# SPDX-License-Identifier: GPL-3.0-or-later
"""The Rendered viewport: the pictures of each view, and the process that traces them."""
