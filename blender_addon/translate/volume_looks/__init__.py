# SPDX-License-Identifier: GPL-3.0-or-later
"""What volumes look like: transfer functions as the core states them and as a Volume data-block keeps them."""
