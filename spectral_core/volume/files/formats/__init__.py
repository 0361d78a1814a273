# SPDX-License-Identifier: GPL-3.0-or-later
"""A reader for each volume format, and a writer for some: ``NAME_format.py``, listed in ``registry``."""
