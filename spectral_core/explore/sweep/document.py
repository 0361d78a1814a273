# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep as a TOML or JSON file: compute node, parameters, region, design, derived columns, reference."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from spectral_core.documents.document import read_document
from spectral_core.errors import InvalidInputError, MissingDependencyError, SpectralError, UnknownNameError, counted
from spectral_core.explore.features.expression import parse
from spectral_core.explore.sweep.designs import Design
from spectral_core.explore.sweep.parameters import Parameter, Space, Value, require_column_name
from spectral_core.explore.sweep.project import Project
from spectral_core.explore.sweep.region import RegionOfInterest

FORMAT, VERSION = "spectral-scene sweep", 1
NodeFactory = Callable[[dict[str, Any], Space, Path], Any]
_EXTRA: dict[str, NodeFactory] = {}
PICTURED = ("scene", "blend", "volume")
"""Types of compute nodes that render a picture and measure its features."""
NAMED = ("function", "command")
"""Types of compute nodes that take a parameter by its name, and read no path."""


@dataclass(frozen=True, slots=True)
class SweepDocument:
    """Contents of a sweep file."""

    space: Space
    region: RegionOfInterest
    design: Design
    compute: dict[str, Any]
    seed: int = 0
    expressions: Mapping[str, str] = field(default_factory=dict)
    reference: Mapping[str, Value] | None = None
    folder: Path = Path()

    def node(self) -> Any:
        """The compute node."""
        return compute_node(self.compute, self.space, self.folder)

    def project(self, fingerprint: str) -> Project:
        """A new project of this sweep."""
        units = {parameter.name: parameter.unit for parameter in self.space.parameters if parameter.unit}
        return Project(
            self.space, self.region, self.design, self.compute, fingerprint, self.seed,
            expressions=dict(self.expressions), units=units,
        )  # fmt: skip


def read_sweep(path: str | Path) -> SweepDocument:
    """The sweep of a TOML or JSON file. FileFormatError names the file and its error."""
    return read_document(path, sweep_of, "a sweep")


def sweep_of(plain: Mapping[str, Any], folder: Path) -> SweepDocument:
    """The sweep of a plain document; files in it are relative to ``folder``."""
    known = {"format", "version", "compute", "parameters", "region", "design", "seed", "columns", "reference"}
    strange = sorted(set(plain) - known)
    if strange:
        raise UnknownNameError.among("entry of a sweep", strange[0], known)
    if plain.get("format", FORMAT) != FORMAT or plain.get("version", VERSION) != VERSION:
        raise InvalidInputError(f"the file says format {plain.get('format')!r}, version {plain.get('version')!r}; "
                                f"expected {FORMAT!r}, version {VERSION}")  # fmt: skip
    tables = plain.get("parameters", [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise InvalidInputError("parameters must be a list of tables: [[parameters]] name = …, low = …, high = …")
    compute = plain.get("compute")
    if not isinstance(compute, dict) or "kind" not in compute:
        raise InvalidInputError("the sweep has no compute node; expected [compute] kind = …")
    for name in ("region", "design", "columns", "reference"):
        if not isinstance(plain.get(name, {}), dict):
            raise InvalidInputError(f"{name} must be a table")
    space = Space(tuple(Parameter.from_dict(table) for table in tables))
    seed = plain.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**31:
        raise InvalidInputError(f"seed is {seed!r}; expected a whole number from 0")
    expressions = dict(plain.get("columns", {}))
    for name, text in expressions.items():
        require_column_name(name)
        if name in space.names:
            raise InvalidInputError(f"[columns] computes {name!r}, which is a parameter; take another name")
        parse(text)
    reference = plain.get("reference")
    if reference is not None:
        reference = _reference(reference, space)
    region = RegionOfInterest.from_dict(plain.get("region", {})).checked(space)
    design = Design.from_dict(plain.get("design", {}))
    if design.kind == "list" and not design.points:
        raise InvalidInputError("the design lists no point; give points = [{…}, …], or take another kind of design")
    if design.points and design.kind != "list":
        raise InvalidInputError(
            f"the design lists {counted(len(design.points), 'point')}, which kind = {design.kind!r} does not "
            "read; leave out the kind, or the points"
        )
    if design.points and design.budget != len(design.points):
        raise InvalidInputError(
            f"the design lists {counted(len(design.points), 'point')} and has a budget of {design.budget}; leave "
            "out the budget"
        )
    return SweepDocument(space, region, design, compute, seed, expressions, reference, folder)


def _reference(given: Mapping[str, Any], space: Space) -> dict[str, Value]:
    """The values of the reference in the types of the parameters; they may lie beyond the ranges and the choices.

    Raises InvalidInputError for one that no point can have.
    """
    if set(given) != set(space.names):
        raise InvalidInputError(f"the reference needs a value for each of {', '.join(space.names)}")
    found: dict[str, Value] = {}
    for parameter in space.parameters:
        value = given[parameter.name]
        try:
            if parameter.kind != "choice":
                parameter.coordinate(value)
                found[parameter.name] = int(value) if parameter.kind == "integer" else float(value)
            elif not any(isinstance(value, str) == isinstance(choice, str) for choice in parameter.choices):
                raise InvalidInputError(f"{parameter.name} is {value!r}; the choices are {list(parameter.choices)}")
            else:
                found[parameter.name] = value
        except (InvalidInputError, TypeError) as error:
            raise InvalidInputError(f"the value of the [reference] is wrong: {error}") from error
    return found


def register_compute(kind: str, factory: NodeFactory) -> None:
    """Add a type of compute node; the add-on adds "blend"."""
    _EXTRA[kind] = factory


def compute_node(compute: Mapping[str, Any], space: Space, folder: Path) -> Any:
    """The compute node of a document's ``[compute]`` table."""
    table = dict(compute)
    kind = table.pop("kind", None)
    if kind in PICTURED:
        _check_names(space)
    if kind in NAMED:
        _check_paths(space, kind)
    try:
        return _made(kind, table, space, folder)
    except SpectralError:
        raise
    except (TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        raise InvalidInputError(f"[compute] kind = {kind!r} cannot be read: {error}; see docs/explore.md") from error


def _check_names(space: Space) -> None:
    """Refuse parameters whose columns the features of the pictures would take."""
    import numpy as np

    from spectral_core.explore.features.images import image_features

    taken = image_features(np.zeros((4, 4, 3), np.float32))
    for name in space.names:
        if name in taken:
            raise InvalidInputError(f"a parameter is named {name!r}, as a feature of every picture is; rename it")


def _check_paths(space: Space, kind: str) -> None:
    """Refuse a path that a compute node would not read."""
    for parameter in space.parameters:
        if parameter.path:
            raise InvalidInputError(
                f"parameter {parameter.name!r} has the path {parameter.path!r}, which kind = {kind!r} does not read; "
                "it takes each parameter by its name. Leave out the path, or name the parameter so"
            )


def _made(kind: Any, table: dict[str, Any], space: Space, folder: Path) -> Any:
    if kind in _EXTRA:
        return _EXTRA[kind](table, space, folder)
    if kind == "blend":
        raise MissingDependencyError(
            "a sweep of a .blend file needs the Blender add-on; run it with `spectral-scene sweep` or "
            "`blender --command spectral sweep`"
        )
    makers = {"function": _function, "command": _command, "scene": _scene, "palette": _palette, "volume": _volume}
    if kind not in makers:
        raise UnknownNameError.among("kind of compute node", str(kind), {*makers, "blend", *_EXTRA})
    return makers[kind](table, space, folder)


def entries(table: Mapping[str, Any], kind: str, needed: str, optional: tuple[str, ...] = ()) -> Any:
    """The needed entry of a ``[compute]`` table, after a check of all its names."""
    strange = sorted(set(table) - {needed, *optional})
    if strange:
        raise UnknownNameError.among(f"entry of [compute] kind = {kind!r}", strange[0], [needed, *optional])
    if needed not in table:
        raise InvalidInputError(f"[compute] kind = {kind!r} needs the entry {needed!r}")
    return table[needed]


def _function(table: dict[str, Any], space: Space, folder: Path) -> Any:
    from spectral_core.explore.sweep.compute.function import FunctionNode

    function, fixed = entries(table, "function", "function", ("fixed",)), table.get("fixed", {})
    swept = next((name for name in space.names if name in fixed), None)
    if swept is not None:
        raise InvalidInputError(f"{swept!r} is swept and in fixed, too; leave out one of them")
    return FunctionNode.of(function, folder, **fixed)


def _command(table: dict[str, Any], space: Space, folder: Path) -> Any:
    from spectral_core.explore.sweep.compute.command import TIME_LIMIT_S, CommandNode

    template = entries(table, "command", "command", ("limit_s",))
    return CommandNode.of(template, space, folder, limit_s=float(table.get("limit_s", TIME_LIMIT_S)))


def _scene(table: dict[str, Any], space: Space, folder: Path) -> Any:
    from spectral_core.explore.sweep.compute.scene import SceneNode

    address = entries(table, "scene", "scene", ("settings", "per_light", "relight"))
    return SceneNode.of(
        address, space, folder, settings=table.get("settings"), per_light=_switch(table, "per_light", False),
        relight=_switch(table, "relight", True),
    )  # fmt: skip


def _switch(table: Mapping[str, Any], name: str, default: bool) -> bool:
    value = table.get(name, default)
    if not isinstance(value, bool):
        raise InvalidInputError(f"[compute] has {name} = {value!r}; expected true or false")
    return value


def _palette(table: dict[str, Any], space: Space, folder: Path) -> Any:
    from spectral_core.explore.sweep.compute.palette import PaletteNode

    return PaletteNode.of(folder / entries(table, "palette", "palette"), space)


def _volume(table: dict[str, Any], space: Space, folder: Path) -> Any:
    from spectral_core.explore.sweep.compute.volume import VolumeNode

    volume = entries(table, "volume", "volume", ("transfer", "settings", "size"))
    size = table.get("size", [256, 256])
    if not isinstance(size, list) or len(size) != 2 or not all(type(count) is int for count in size):
        raise InvalidInputError(f"the size of the pictures is {size!r}; expected two whole numbers, such as [256, 256]")
    return VolumeNode.of(
        volume, str(table.get("transfer", "wide")), space, folder, settings=table.get("settings"),
        size=(size[0], size[1]),
    )  # fmt: skip
