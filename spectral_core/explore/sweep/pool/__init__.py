# SPDX-License-Identifier: GPL-3.0-or-later
"""Worker processes that stay: the executor, and the process."""
