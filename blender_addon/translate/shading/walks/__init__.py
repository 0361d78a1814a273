# SPDX-License-Identifier: GPL-3.0-or-later
"""Orders in which nodes are read: each once, however often it is linked, and without deep recursion."""
