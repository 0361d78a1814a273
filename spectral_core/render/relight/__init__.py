# SPDX-License-Identifier: GPL-3.0-or-later
"""Light later: what a transport render stored becomes a picture under other lights without tracing a ray."""
