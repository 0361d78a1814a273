# SPDX-License-Identifier: GPL-3.0-or-later
"""The palette while it is edited: what changed is solved again, at once or when the artist rests."""
