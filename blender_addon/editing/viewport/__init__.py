# SPDX-License-Identifier: GPL-3.0-or-later
"""The Rendered viewport: what each view shows, and the process that traces it."""
