# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear light models (section 5.1.2): a surface as a few coefficients, a light as a 3×m matrix.

=================  ==========================================  ==========================
model              coefficients of a surface                   multiplications, reflection
=================  ==========================================  ==========================
``RgbModel``       its color under a reference light            3
``BasisModel``     weights of principal components (Eq. 5.7)    m²
``FactorModel``    weights of sharpened components              m
``NodeModel``      its reflectance at m wavelengths             m
=================  ==========================================  ==========================

Color under a light is one 3×m product for all of them. ``docs/light_models.md`` has the accuracy of each.
"""

from spectral_core.light_models.basis import BasisModel, principal_components, representative_spectra
from spectral_core.light_models.factor import FactorModel, sharpened_basis
from spectral_core.light_models.interface import LightModel
from spectral_core.light_models.nodes import NATURAL_NODES_NM, NodeModel
from spectral_core.light_models.rgb import RgbModel

__all__ = [
    "NATURAL_NODES_NM",
    "BasisModel",
    "FactorModel",
    "LightModel",
    "NodeModel",
    "RgbModel",
    "principal_components",
    "representative_spectra",
    "sharpened_basis",
]
