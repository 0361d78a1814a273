# SPDX-License-Identifier: GPL-3.0-or-later
"""The JSON object that ``--json`` prints as the last line."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def print_json(report: Mapping[str, Any]) -> None:
    """Print a report in one line."""
    print(json.dumps(finite(report), allow_nan=False))


def finite(value: Any) -> Any:
    """The value with None for each NaN and infinity, which JSON does not have."""
    if isinstance(value, Mapping):
        return {name: finite(each) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
