# SPDX-License-Identifier: GPL-3.0-or-later
"""Which effects a scene calls for, and why."""
