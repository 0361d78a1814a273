# SPDX-License-Identifier: GPL-3.0-or-later
"""What rough and layered closures share: facets, thin films, albedos, valid normals."""
