# SPDX-License-Identifier: GPL-3.0-or-later
"""What a viewport needs of a translation: its view, its light, and what is kept from one edit to the next."""
