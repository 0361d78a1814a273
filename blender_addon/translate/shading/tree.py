# SPDX-License-Identifier: GPL-3.0-or-later
"""Walking a node tree backward from a socket, through reroutes, muted nodes and node groups."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

MOST_HOPS = 1000
"""Longer chains are not followed: only a broken file contains one."""
Key = tuple[int, tuple[int, ...]]
"""Pointers of a socket or node and of the groups around it."""


@dataclass(frozen=True)
class _Searched:
    """What was found in trees, by their pointers: the effective link of each linked input, and what is read."""

    links: dict[int, dict[int, Any]] = field(default_factory=dict)
    read: dict[int, set[Key]] = field(default_factory=dict)


_searched: ContextVar[_Searched | None] = ContextVar("_searched", default=None)
"""Within ``searched_once`` what was found. Icons are read on another thread, which has a value of its own."""


@contextmanager
def searched_once() -> Iterator[None]:
    """Within it each tree is searched for its links once, so nothing may change a tree.

    Blender's ``socket.links`` compares a socket with all links of its tree, which makes long trees quadratic.
    """
    token = _searched.set(_Searched())
    try:
        yield
    finally:
        _searched.reset(token)


@dataclass(frozen=True)
class Input:
    """An input socket, and the group nodes around its node, outermost first."""

    socket: Any
    groups: tuple[Any, ...] = ()

    @property
    def node(self) -> Any:
        return self.socket.node

    def source(self) -> Output | Input:
        """Its source: the output of an active node, or the input whose own value is used.

        Values of reroutes and muted nodes are not used: an input behind them keeps its own value.
        """
        return self.path()[0]

    def path(self) -> tuple[Output | Input, tuple[str, ...]]:
        """Its source, and the types of the sockets of groups and muted nodes from there to here."""
        place: Input = self
        kinds: list[str] = []
        last_own, passed = place, 0
        for _ in range(MOST_HOPS):
            link = _link(place.socket)
            step = None if link is None else _through(link.from_socket, place.groups)
            if isinstance(step, Output):
                return step, tuple(reversed(kinds))
            if step is None:
                break
            if link.from_node.type != "REROUTE":
                kinds.append((step.socket if link.from_node.type == "GROUP_INPUT" else link.from_socket).type)
            place = step
            if not (place.node.mute or place.node.type == "REROUTE"):
                last_own, passed = place, len(kinds)
        return last_own, tuple(reversed(kinds[:passed]))

    @property
    def default(self) -> Any:
        """The value of the socket itself; None if its type has none."""
        return getattr(self.socket, "default_value", None)


@dataclass(frozen=True)
class Output:
    """An output socket of an active node, and the group nodes around it."""

    socket: Any
    groups: tuple[Any, ...] = ()

    @property
    def node(self) -> Any:
        return self.socket.node

    def input(self, name: str) -> Input | None:
        """Input of this node by identifier, else by name; None if this Blender's node has no such input."""
        return _named(self.node.inputs, name, self.groups)

    def value(self, name: str, fallback: Any = None) -> Any:
        """Value of the input itself, even if it is linked; ``fallback`` if it does not exist."""
        found = self.input(name)
        return fallback if found is None or found.default is None else found.default

    @property
    def label(self) -> str:
        """The node's label, or its type's name."""
        node = self.node
        return str(node.label or (node.bl_label if hasattr(node, "bl_label") else node.name))


def input_of(node: Any, name: str, groups: tuple[Any, ...] = ()) -> Input:
    """Input of a node that always has it; Blender itself does not find one by its name that a script has disabled."""
    found = _named(node.inputs, name, groups)
    if found is None:
        raise KeyError(f"{node.name!r} has no input {name!r}")
    return found


def _named(sockets: Any, name: str, groups: tuple[Any, ...]) -> Input | None:
    for attribute in ("identifier", "name"):
        for socket in sockets:
            if getattr(socket, attribute) == name:
                return Input(socket, groups)
    return None


def _link(socket: Any) -> Any:
    """The effective link: an input has at most one, unless it is muted or broken."""
    if not socket.is_linked:
        return None
    searched = _searched.get()
    if searched is None:
        return next((link for link in socket.links if not link.is_muted and link.is_valid), None)
    tree, trees = socket.id_data, searched.links
    if (found := trees.get(tree.as_pointer())) is None:
        found = trees[tree.as_pointer()] = {}
        for link in tree.links:
            if not link.is_muted and link.is_valid:
                found.setdefault(link.to_socket.as_pointer(), link)
    return found.get(socket.as_pointer())


def _through(socket: Any, groups: tuple[Any, ...]) -> Output | Input | None:
    """The output itself if its node is active, the next input if it only passes data on, None at a dead end."""
    node = socket.node
    if node.mute and node.type != "REROUTE":
        inner = next((link for link in node.internal_links if link.to_socket == socket), None)
        return None if inner is None else Input(inner.from_socket, groups)
    if node.type == "REROUTE":
        return Input(node.inputs[0], groups)
    if node.type == "GROUP_INPUT":
        return _named(groups[-1].inputs, socket.identifier, groups[:-1]) if groups else None
    if node.type == "GROUP":
        ends = output_nodes(node.node_tree, "GROUP_OUTPUT")
        return _named(ends[0].inputs, socket.identifier, (*groups, node)) if ends else None
    return Output(socket, groups)


def output_nodes(tree: Any, kind: str) -> list[Any]:
    """Nodes of a type in a tree, the active one first: the first of several, as in Blender's copies of groups."""
    if tree is None:
        return []
    found = [node for node in tree.nodes if node.type == kind and not node.mute]
    active = next((node for node in found if getattr(node, "is_active_output", False)), None)
    return sorted(found, key=lambda node: node != active)


def surface_output(tree: Any, kind: str = "OUTPUT_MATERIAL") -> Any:
    """The output node for this engine: Blender's choice among those for all engines and for Cycles."""
    found = [node for node in output_nodes(tree, kind) if getattr(node, "target", "ALL") in ("ALL", "CYCLES")]
    cycles_first = sorted(found, key=lambda node: getattr(node, "target", "ALL") != "CYCLES")
    return cycles_first[0] if cycles_first else None


def linked(place: Input | None) -> Output | None:
    """The output linked to an input; None without a link. A color or number at a shader's socket is emitted."""
    if place is None:
        return None
    source = place.source()
    if not isinstance(source, Output):
        return None
    is_emitted = place.socket.type == "SHADER" and source.socket.type != "SHADER"
    return _emitted(place, source.socket) if is_emitted else source


def _emitted(place: Input, linked_socket: Any) -> Output:
    """The Emission node that Cycles puts between a shader's socket and a color or number that is linked to it."""
    fed = _Fed(place.socket, *(("Strength", "VALUE") if linked_socket.type == "VALUE" else ("Color", "RGBA")))
    return Output(_Emits(_Emission((fed,))), place.groups)


@dataclass(frozen=True)
class _Fed:
    """A shader's socket as an input of the Emission node before it: all but its name and type is the socket's own."""

    _socket: Any
    name: str
    type: str

    @property
    def identifier(self) -> str:
        return self.name

    def __getattr__(self, name: str) -> Any:
        return getattr(self._socket, name)


@dataclass(frozen=True)
class _Emission:
    """A node of a tree that holds no such node."""

    inputs: tuple[_Fed, ...]
    type = "EMISSION"
    name = label = bl_label = "Emission"

    def as_pointer(self) -> int:
        return -int(self.inputs[0].as_pointer())


@dataclass(frozen=True)
class _Emits:
    """The output of such a node."""

    node: _Emission
    type = "SHADER"
    name = "Emission"

    def as_pointer(self) -> int:
        return self.node.as_pointer()


def wanted_aovs(depsgraph: Any) -> dict[str, str]:
    """Type of each AOV of the view layer, by name."""
    return {aov.name: aov.type for aov in depsgraph.view_layer_eval.aovs if aov.is_valid}


def aov_nodes(tree: Any, groups: tuple[Any, ...] = ()) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """The active AOV Output nodes of a tree, then those of its groups, and the group nodes around each."""
    nodes = [] if tree is None else [node for node in tree.nodes if not node.mute]
    yield from ((node, groups) for node in nodes if node.type == "OUTPUT_AOV")
    for node in nodes:
        if node.type == "GROUP" and all(node.node_tree != group.node_tree for group in groups):
            yield from aov_nodes(node.node_tree, (*groups, node))


def is_read(output: Output, name: str, aovs: Collection[str]) -> bool:
    """True if what is rendered reads the output ``name`` of the same node. Cycles leaves out all other nodes.

    ``aovs``: names of the AOVs that are rendered.
    """
    socket = next((socket for socket in output.node.outputs if socket.name == name), None)
    if socket is None or not socket.is_linked:
        return False
    tree, searched = (*output.groups, output.node)[0].id_data, _searched.get()
    if searched is None:
        return _key(socket, output.groups) in _read_sockets(tree, aovs)
    if tree.as_pointer() not in searched.read:
        searched.read[tree.as_pointer()] = _read_sockets(tree, aovs)
    return _key(socket, output.groups) in searched.read[tree.as_pointer()]


def _key(item: Any, groups: tuple[Any, ...]) -> Key:
    return item.as_pointer(), tuple(group.as_pointer() for group in groups)


def _read_sockets(tree: Any, aovs: Collection[str]) -> set[Key]:
    """The output sockets in a tree and its groups that its active outputs read."""
    ends = [(surface_output(tree, kind), ()) for kind in ("OUTPUT_MATERIAL", "OUTPUT_WORLD", "OUTPUT_LIGHT")]
    ends += [(node, groups) for node, groups in aov_nodes(tree) if node.aov_name in aovs]
    waiting = [Input(socket, groups) for node, groups in ends if node is not None for socket in node.inputs]
    sockets: set[Key] = set()
    nodes: set[Key] = set()
    while waiting:
        source = linked(waiting.pop())
        if source is None:
            continue
        sockets.add(_key(source.socket, source.groups))
        if (node := _key(source.node, source.groups)) not in nodes:
            nodes.add(node)
            waiting += [Input(socket, source.groups) for socket in mixed(source.node)]
    return sockets


def mixed(node: Any) -> list[Any]:
    """The input sockets that a node reads: of Mix Shader one shader where its factor shows that one alone."""
    sockets = [socket for socket in node.inputs if socket.enabled]
    if node.type != "MIX_SHADER" or sockets[0].is_linked or 0 < sockets[0].default_value < 1:
        return sockets
    return [sockets[1 if sockets[0].default_value <= 0 else 2]]
