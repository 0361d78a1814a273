# SPDX-License-Identifier: GPL-3.0-or-later
"""The palette during editing: changes are solved at once, or when the artist pauses."""
