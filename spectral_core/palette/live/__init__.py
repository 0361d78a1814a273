# SPDX-License-Identifier: GPL-3.0-or-later
"""The palette while it is edited: sessions and the fast solver under them."""
