# SPDX-License-Identifier: GPL-3.0-or-later
"""``volume.spectral``: the transfer function of a Volume data-block, and its sampling.

Curves are Float Curve nodes in a node group of the volume, the only place where Blender stores curves that an artist
can edit; x is the fraction of the data's range, y the fraction of the material's density.
"""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from bpy.types import Context, Depsgraph, PropertyGroup, Scene, Volume

from ..compat import is_editable, path_options
from .fields import Field, by_name
from .spectrum import SpectralSpectrum

VOLUME_FIELDS = by_name(
    Field(
        "rule", EnumProperty, "rule", name="Steps", default="auto",
        description="How the steps along a ray are chosen",
        items=[
            ("auto", "Automatic", "The rule with the fewest samples and the least time for the wanted error", 0),
            ("uniform", "Uniform", "The same step everywhere", 1),
            ("thesis", "Sampling Theorem", "Steps from the local band limit, as the thesis derives it (Eq. 4.14)", 2),
            ("error", "Even Error", "Steps that spread the error evenly over the ray", 3),
            ("cells", "Cell Faces", "Even error, and steps end where the ray enters another cell of the data", 4),
        ],
    ),
    Field(
        "quality_db", FloatProperty, "quality", name="Quality", default=50.0, min=20.0, max=90.0, precision=0,
        description="Signal-to-noise ratio of the picture in dB: 40 for a preview, 50 good, 60 beyond any display",
    ),
    Field(
        "lighting", EnumProperty, "lighting", name="Lighting", default="scene",
        description="How lit materials get their light. Of several volumes, the most thorough setting counts for all",
        items=[
            ("even", "Even", "White light from everywhere: each material shows its color, easiest to read", 0),
            ("scene", "Scene", "The scene's lights, with shading by the gradient of the data", 1),
            ("shadows", "Scene, Shadows", "The scene's lights with shadows, to and from surfaces; slower", 2),
        ],
    ),
)  # fmt: skip
"""Sampling and lighting of a volume, shared with the core's ``VolumeObject``."""
RANGE_KEY = "spectral_range"
"""Least and greatest data value, stored in double precision on the data-block itself."""

LEAST_STEEPNESS = 1e-6
"""Least right end of the curve of edges: change per voxel, as a fraction of the data's range."""


def _changed(properties: PropertyGroup, _context: Context = None) -> None:
    """Tag the data-block as changed, so that Blender updates its evaluated copies."""
    properties.id_data.update_tag()


def _grid_changed(properties: PropertyGroup, _context: Context = None) -> None:
    """A sequence of Blender's own has the range of another grid then; an imported volume has one grid only."""
    if not properties.source and RANGE_KEY in properties.id_data:
        del properties.id_data[RANGE_KEY]
    _changed(properties)


class SpectralVolumeMaterial(bpy.types.PropertyGroup):
    """One material of a transfer function; ``name`` is its name, its curves are nodes named after ``uid``."""

    uid: IntProperty()
    color: FloatVectorProperty(
        name="Color", update=_changed, subtype="COLOR", size=3, min=0.0, max=1.0, default=(0.8, 0.8, 0.8),
        description="Color of the material if it has no spectrum",
    )  # fmt: skip
    spectral: PointerProperty(type=SpectralSpectrum)
    density: FloatProperty(
        name="Density", update=_changed, default=0.1, min=0.0, soft_max=2.0, precision=3,
        description="Extinction per voxel where the density curve is at its top",
    )  # fmt: skip
    emission: FloatProperty(
        name="Emission", update=_changed, default=0.0, min=0.0, soft_max=1.0, precision=3,
        description="Emission per voxel where the emission curve is at its top. Without density: an X-ray",
    )  # fmt: skip
    lit: BoolProperty(
        name="Lit by the Scene", update=_changed, default=True,
        description="The color is a reflectance, lit by the scene's lights; if off, the material emits light",
    )  # fmt: skip
    use_gradient: BoolProperty(
        name="Only Edges", update=_changed, default=False,
        description="Weigh the material by how quickly the data change: boundaries show and insides do not",
    )  # fmt: skip
    gradient: FloatProperty(
        name="Steepness", update=_changed, default=0.1, min=LEAST_STEEPNESS, soft_max=1.0, precision=3,
        description="Right end of the edge curve: change per voxel, as a fraction of the data's range",
    )  # fmt: skip


class SpectralVolume(bpy.types.PropertyGroup):
    """Data of this extension on a Volume."""

    enabled: BoolProperty(
        name="Transfer Function", update=_changed, default=False,
        description="Render the data with this transfer function; otherwise with the volume's shader",
    )  # fmt: skip
    materials: CollectionProperty(type=SpectralVolumeMaterial)
    active: IntProperty(name="Material", min=0, description="The selected material")
    next_uid: IntProperty(default=1)
    curves: PointerProperty(type=bpy.types.NodeTree, update=_changed, description="Holds the curves of the materials")
    rule: VOLUME_FIELDS["rule"].declared(_changed)
    lighting: VOLUME_FIELDS["lighting"].declared(_changed)
    quality_db: VOLUME_FIELDS["quality_db"].declared(_changed)
    grid: StringProperty(
        name="Grid", update=_grid_changed, default="density", description="Which grid of the OpenVDB file is shown"
    )
    source: StringProperty(
        name="Source", subtype="FILE_PATH", options=path_options(),
        description="File that this volume was imported from",
    )  # fmt: skip
    facts: StringProperty(description="Size and type of the data, for the panel")


CLASSES = (SpectralVolumeMaterial, SpectralVolume)


def own_curves(volume: Volume) -> None:
    """Give a Volume a separate node group of its curves if other data use the same one, or if it is linked.

    Blender copies the pointer to the node group alone when a Volume is copied. Every change of curves begins with this.
    """
    tree = volume.spectral.curves
    if tree is not None and (tree.library is not None or tree.users - tree.use_fake_user > 1):
        volume.spectral.curves = tree.copy()


@bpy.app.handlers.persistent
def _separate_copies(_scene: Scene, depsgraph: Depsgraph) -> None:
    """Separate the curves of a copied Volume, because the curve widgets in the panel change nodes without a call."""
    if not depsgraph.id_type_updated("VOLUME") or bpy.app.is_job_running("RENDER"):
        return  # nothing is written while a render reads
    for update in depsgraph.updates:
        volume = update.id.original
        if isinstance(volume, Volume) and is_editable(volume):
            own_curves(volume)


def register() -> None:
    """Add ``spectral`` to Volume data-blocks, and start separating the curves of copies."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Volume.spectral = PointerProperty(type=SpectralVolume, name="Spectral")
    bpy.app.handlers.depsgraph_update_post.append(_separate_copies)


def unregister() -> None:
    """Remove the attribute; stored data stay in the file."""
    bpy.app.handlers.depsgraph_update_post.remove(_separate_copies)
    del bpy.types.Volume.spectral
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
