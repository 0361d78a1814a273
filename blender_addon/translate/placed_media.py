# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume shaders that vary, in the objects that have them: meshes, and the grids of Volume objects."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Instance, Material, Mesh, ScatteringMedium
from spectral_core.scene.geometry import BORDER_MARGIN, VOLUME_BOX, box_of, index_box, unit_box

from .camera import space_from_world
from .shading.attributes import PREFIX, object_attributes, object_info, root_of
from .shading.materials import TranslatedMaterial
from .shading.media.regions import NAMED, TOO_COARSE, Region, medium_in_box, medium_of_grids
from .shading.media.shaders import GRID
from .viewport.kept import kept_or_made
from .volumes import SEVERAL_GRIDS, GridFile

FAINT = 1e-3
"""Share of the densest part of a medium below which its end cannot be seen."""
EDGE_MARGIN = 1e-3
"""Voxels between a tile and the box around its medium, which cuts it off there."""

if TYPE_CHECKING:
    from spectral_core.volume.files.vdb.together import CommonVoxels

    from .objects import Collected


def in_mesh(
    found: Collected, obj: Any, instance: Any, mesh: Mesh, item: TranslatedMaterial, state: tuple[Any, ...]
) -> TranslatedMaterial:
    """A material whose volume varies, for one object; ``state``: other data that it depends on."""
    box = box_of(mesh)
    if item.filling is None or not len(box):
        return item
    corners = np.array([box.min(axis=0), box.max(axis=0)])
    data = obj.data
    has_space = hasattr(data, "texspace_location")
    center, half = (
        (np.array(data.texspace_location[:]), np.array(data.texspace_size[:])) if has_space
        else (corners.mean(axis=0), np.ptp(corners, axis=0) / 2)
    )  # fmt: skip
    placed = _placed(found, obj, instance, center, half, item.filling.inputs)
    # the name is taken even if the medium is not kept; another object would get the same name otherwise
    name = found.unique("material", f"{item.material.name} in {obj.name_full}")

    def make() -> TranslatedMaterial:
        assert item.filling is not None
        medium, error = medium_in_box(item.filling, corners, placed)
        _note_loss(found, obj, error)
        return _specific(item, name, medium)

    made: TranslatedMaterial = _kept(
        found, obj, instance, f"medium {item.material.name}", (*state, *_facts(item, placed), mesh, name), make
    )
    found.translated["medium", made.material.name] = made
    return made


def in_volume(found: Collected, obj: Any, instance: Any, item: TranslatedMaterial, file: GridFile) -> Instance | None:
    """The box of a Volume object with its shader's medium; None for empty space. Raises InvalidInputError."""
    world_from_object = np.array(instance.matrix_world, dtype=np.float64)
    name = found.unique("instance", obj.name_full)
    material = found.unique("material", name)
    assert item.filling is not None
    # as in Cycles, Generated coordinates of a Volume object are those of the object
    placed = _placed(found, obj, instance, np.full(3, 0.5), np.full(3, 0.5), item.filling.inputs)
    scale = _density_scale(obj.data, world_from_object)

    def make() -> tuple[NDArray[np.float64], TranslatedMaterial] | None:
        voxels = file.grids()
        filled, error = _filled(item, file, placed, scale, material)
        _note_loss(found, obj, error)
        for words in _differences(voxels, None if filled is None else filled[1].material.medium):
            found.translation.note(obj.name, words)
        return filled

    state = (world_from_object.tobytes(), *_facts(item, placed), file, scale, material)
    made = _kept(found, obj, instance, "medium of a volume", state, make)
    if made is None:
        return None
    border, filled = made
    found.translated["medium", material] = filled
    box = found.meshes[VOLUME_BOX] = unit_box()
    return Instance(
        name, box.name, world_from_object @ border, (material,), group=obj.original.lightgroup,
        index=int(obj.pass_index), shown_as=obj.name,
        asset=root_of(obj.original).name,
    )  # fmt: skip


def _differences(voxels: CommonVoxels, medium: ScatteringMedium | None) -> Iterator[str]:
    """What is rendered with less detail than the grids have, or in another way than in Cycles, in words."""
    for name in voxels.resampled:
        yield f"its grid {name!r} is finer than the voxels that fit; it was resampled"
    for name in voxels.repeated:
        yield SEVERAL_GRIDS.format(name=name)
    for name in voxels.mirrored:
        yield (
            f"the transform of its grid {name!r} is mirrored: Cycles shows nothing of it, here it is seen; mirror the "
            "object, not the grid"
        )
    given = () if medium is None or medium.grid is None else medium.grid.given
    faces = (np.take(values, end, axis=axis) for values in given for axis in range(3) for end in (0, -1))
    shines_everywhere = (
        medium is not None and medium.emission_strength > 0 and (medium.grid is None or medium.grid.emission is None)
    )
    # where voxels are clipped, Cycles ends the volume as well
    if not voxels.is_clipped and (shines_everywhere or any(values.max() > FAINT for values in faces)):
        yield "its shader gives a volume where the grids have no voxels: it ends a voxel beyond them, unlike in Cycles"


def _filled(
    item: TranslatedMaterial, file: GridFile, placed: Region, scale: float, name: str
) -> tuple[tuple[NDArray[np.float64], TranslatedMaterial] | None, float]:
    """The box around a file's voxels in object space, and the material with its medium; None for empty space. Beside it
    the error of interpolation between voxels.
    """
    voxels = file.grids()
    assert item.filling is not None
    is_cubic = item.filling.is_cubic
    if is_cubic:  # a B-spline fades out over two voxels
        voxels = voxels.surrounded()
    region = replace(
        placed, shape=voxels.shape, world_from_index=placed.world_from_object @ voxels.world_from_index,
        grids=voxels.grids, is_cubic=is_cubic,
    )  # fmt: skip

    def alone(grid: str) -> Region:
        if grid not in voxels.interpolated:
            return region
        own = replace(file, names=(grid,), clipping=None).grids()
        world_from_index = placed.world_from_object @ own.world_from_index
        return replace(region, shape=own.shape, world_from_index=world_from_index, grids=own.grids)

    medium, shape, parts, error = medium_of_grids(item.filling, region, alone)
    if medium is None:
        return None, error
    medium = replace(medium, density=medium.density * scale, emission_strength=medium.emission_strength * scale)
    object_from_index = voxels.world_from_index @ np.diag([*(1.0 / parts,) * 3, 1.0])
    start = np.where(voxels.begins > 0, voxels.begins * parts - EDGE_MARGIN, -0.5 - BORDER_MARGIN)
    border = object_from_index @ index_box(shape, BORDER_MARGIN, start)
    return (border, _specific(replace(item, material=replace(item.material, surface=None)), name, medium)), error


def _note_loss(found: Collected, obj: Any, error: float) -> None:
    """Name a volume that varies more finely than its grid."""
    if error > TOO_COARSE:
        words = f"its volume varies more finely than the grid that it is rendered with; {100 * error:.0f} % is lost"
        found.translation.note(obj.name, words)


def _kept(found: Collected, obj: Any, instance: Any, kind: str, state: tuple[Any, ...], make: Callable[[], Any]) -> Any:
    """The result of ``make``; in a viewport that of an earlier translation if nothing that it reads has changed."""
    number = obj.original.session_uid
    makers, place = [number, obj.original.data.session_uid], tuple[Any, ...]()
    if instance.is_instance:  # each copy is elsewhere, or has other attributes
        parent = instance.parent
        place = (0 if parent is None else parent.original.session_uid, *instance.persistent_id)
        makers += place[:1]
    return kept_or_made(found.kept, found.translation, (kind, (number, *place)), frozenset(makers), state, make)


def _facts(item: TranslatedMaterial, placed: Region) -> tuple[Any, ...]:
    """What a volume shader reads of its object and of the camera."""
    assert item.filling is not None
    settings = {each for program in item.filling.programs_of for step in program.instructions for each in step.settings}
    camera = placed.camera_from_world.tobytes() if "CAMERA" in settings else b""
    return item, tuple(sorted(placed.facts.items())), camera


def _density_scale(data: Any, world_from_object: NDArray[np.float64]) -> float:
    """Factor on densities: they are per unit of length of the object, or of the world if the data states so."""
    render = getattr(data, "render", None)
    if render is not None and render.space == "WORLD":
        return 1.0
    length = float(np.linalg.norm(world_from_object[:3, :3] @ np.full(3, 3**-0.5)))
    return 1.0 / length if length > 0 else 1.0


def grids_read(inputs: Iterable[str]) -> list[str]:
    """Names of the grids that a shader reads, the density first."""
    names = {name.partition(":")[2] for name in inputs if name.startswith((GRID, *NAMED))}
    return sorted(names, key=lambda name: (name != "density", name))


def _specific(item: TranslatedMaterial, name: str, medium: ScatteringMedium | None) -> TranslatedMaterial:
    material: Material = replace(item.material, name=name, medium=medium)
    return TranslatedMaterial(material, item.reads)


def _placed(
    found: Collected, obj: Any, instance: Any, center: NDArray[Any], half: NDArray[Any], inputs: frozenset[str]
) -> Region:
    """Where an object is, and what its nodes read of it."""
    matrix = np.array(instance.matrix_world, dtype=np.float64)
    translation = found.translation
    reads = frozenset(name for name in inputs if name.startswith(PREFIX))
    facts = dict(object_attributes(obj, instance, reads, found))
    facts |= object_info(obj, instance)
    if any(name.startswith("ray:") for name in inputs):
        translation.note(obj.name, "its volume depends on the type of ray; all rays see what the camera sees")
    viewer = space_from_world(translation.scene.camera, translation.render)
    half = np.where(half == 0, 1.0, half)
    return Region((1, 1, 1), np.eye(4), matrix, viewer, center, half, facts)
