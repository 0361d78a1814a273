# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo: a still life whose painted branch appears only under a sodium street lamp (thesis 5.4.3)."""
