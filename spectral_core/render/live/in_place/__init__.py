# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of a loaded scene in place: which numbers differ, and how they get into the objects of the renderer."""
