# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes that a socket depends on, in an order, each once."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from ..tree import Input, Output, linked

Result = TypeVar("Result")


def is_sum(source: Output) -> bool:
    """True for a mix or sum of two shaders."""
    return source.node.type in ("MIX_SHADER", "ADD_SHADER")


def shader_inputs(source: Output) -> list[Input]:
    """The shader sockets of a node."""
    return [Input(socket, source.groups) for socket in source.node.inputs if socket.type == "SHADER"]


def sum_inputs(source: Output) -> list[Input]:
    """The shader sockets of a mix or sum; none of other nodes."""
    return shader_inputs(source) if is_sum(source) else []


def all_inputs(source: Output) -> list[Input]:
    """All sockets of a node."""
    return [Input(socket, source.groups) for socket in source.node.inputs]


def in_order(
    source: Output | None, places: Callable[[Output], list[Input]] = sum_inputs
) -> list[tuple[Output, list[Output | None]]]:
    """The nodes from ``source`` backward along the inputs ``places``, each after those that it reads, with what is
    linked to these inputs (None: nothing). A link that closes a circle is none.
    """
    found: list[tuple[Output, list[Output | None]]] = []
    read: dict[Output, list[Output | None]] = {}
    done: set[Output] = set()
    stack = [] if source is None else [source]
    while stack:
        item = stack[-1]
        if item not in read:
            before = [linked(place) for place in places(item)]
            read[item] = [None if each in read and each not in done else each for each in before]
            stack += [each for each in reversed(read[item]) if each is not None and each not in read]
            continue
        stack.pop()
        if item not in done:
            done.add(item)
            found.append((item, read[item]))
    return found


def folded(
    source: Output | None,
    made: Callable[[Output, list[Result]], Result],
    empty: Result,
    places: Callable[[Output], list[Input]] = sum_inputs,
) -> Result:
    """The result of ``made`` for a shader, from the results of the shaders that it reads; each is made once.

    ``empty``: the result for an unlinked socket; ``places``: the sockets of a shader that are read.
    """
    results: dict[Output, Result] = {}
    for item, before in in_order(source, places):
        results[item] = made(item, [empty if each is None else results[each] for each in before])
    return empty if source is None else results[source]
