# SPDX-License-Identifier: GPL-3.0-or-later
"""What several commands share; no command stands here."""
