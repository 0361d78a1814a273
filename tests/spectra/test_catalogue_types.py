# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers in place of names, and names in place of spectra, have an error that says what is expected; spaces do not."""

from __future__ import annotations

from typing import Any

import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.spectra.catalogue import (
    illuminant,
    illuminant_names,
    is_illuminant,
    reflectance,
    reflectance_names,
)
from spectral_core.spectra.observer import normalized


@pytest.mark.parametrize(("call", "given"), [(illuminant, 5), (reflectance, 5.0), (illuminant, None)])
def test_a_name_is_a_text(call: Any, given: Any) -> None:
    with pytest.raises(InvalidInputError, match="expected text"):
        call(given)


def test_a_light_is_a_spectrum() -> None:
    with pytest.raises(InvalidInputError, match="'D65'; expected a spectrum"):
        normalized("D65")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="luminance is x"):
        normalized(illuminant("D65"), luminance="x")  # type: ignore[arg-type]


def test_spaces_around_a_name_do_not_count() -> None:
    """A name that was pasted into a field has them at times, and cannot be seen to."""
    for name in ("D65 ", " sodium", "\tblackbody 3200\n"):
        assert is_illuminant(name)
        assert illuminant(name) is illuminant(name.strip())
    assert reflectance(" dark skin ") is reflectance("dark skin")
    assert all(name == name.strip() for name in (*illuminant_names(), *reflectance_names()))
