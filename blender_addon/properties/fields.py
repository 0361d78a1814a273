# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings shared with the core, declared once: the panel's property and both translations are made from this."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from bpy.props import CollectionProperty, PointerProperty


class Field:
    """One setting: its property in Blender, and its attribute of the core's dataclass.

    Parameters
    ----------
    name
        Identifier of the property.
    make
        Function that declares it, such as ``bpy.props.FloatProperty``.
    core
        Attribute of the core's dataclass; several if one switch sets them together.
    options
        Keyword arguments of ``make``: label, range, default, help.
    """

    def __init__(self, name: str, make: Callable[..., Any], core: str | tuple[str, ...], /, **options: Any) -> None:
        self.name = name
        self.core = (core,) if isinstance(core, str) else core
        self.options: Mapping[str, Any] = MappingProxyType(options)
        self._make = make

    def declared(self, update: Callable[[Any, Any], None]) -> Any:
        """The property, for the body of a PropertyGroup. ``update``: called after each change."""
        return self._make(update=update, **self.options)

    @property
    def choices(self) -> tuple[str, ...]:
        """Identifiers of an enumeration; empty for everything else."""
        return tuple(item[0] for item in self.options.get("items", ()))


def by_name(*fields: Field) -> Mapping[str, Field]:
    """The fields of a group, by the identifiers of their properties."""
    return MappingProxyType({field.name: field for field in fields})


def without_keyframes(*groups: type) -> None:
    """Let no property of these groups be keyframed or driven; called before they are registered.

    Blender calls no ``update`` for a value that an animation changes, so whatever follows from it would be outdated.
    """
    for group in groups:
        for declared in group.__annotations__.values():
            if declared.function not in (CollectionProperty, PointerProperty):
                declared.keywords.setdefault("options", set())
