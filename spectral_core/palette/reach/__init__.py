# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors that a cell can show: under the present requests, and given exact colors under other lights."""
