# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of the power heuristic, also for densities whose squares no float holds."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")


@pytest.mark.parametrize("pdf", [0.0, 1e-30, 1e-3, 1.0, 1e18, 1e25, 1e38])
@pytest.mark.parametrize("other", [0.0, 1e-30, 1e-3, 1.0, 1e18, 1e25, 1e38])
def test_weights_of_two_methods_add_up_to_one(pdf: float, other: float) -> None:
    """Both were 0 from densities of about 2e19 on, so that the light of a tiny far lamp was lost."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    from spectral_core.render.trace.path.limits import squared_share

    own, others = (
        float(np.array(squared_share(mi.Float(one), mi.Float(two)))[0]) for one, two in ((pdf, other), (other, pdf))
    )
    assert own + others == pytest.approx(0.0 if pdf == other == 0.0 else 1.0)
    if pdf or other:
        assert own == pytest.approx(pdf**2 / (pdf**2 + other**2), rel=1e-6, abs=1e-30)
