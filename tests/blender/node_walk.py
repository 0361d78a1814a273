# SPDX-License-Identifier: GPL-3.0-or-later
"""A shader node of each type in a material, world or lamp, and what changes its translation."""

from __future__ import annotations

import contextlib
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import bpy

from tests.settings_walk import fingerprint, other_rna, read_rna, settings_of

STRUCTS = {
    "texture_mapping": ("TexMapping", lambda node: node.texture_mapping),
    "color_ramp": ("ColorRamp", lambda node: node.color_ramp),
    "color_ramp.elements[0]": ("ColorRampElement", lambda node: node.color_ramp.elements[0]),
    "mapping": ("CurveMapping", lambda node: node.mapping),
    "mapping.curves[0].points[0]": ("CurveMapPoint", lambda node: node.mapping.curves[0].points[0]),
}
"""Structs of a node whose settings the ledger lists separately: name in the ledger, and how to get it."""
OUTPUTS = {"MATERIAL": "ShaderNodeOutputMaterial", "WORLD": "ShaderNodeOutputWorld", "LIGHT": "ShaderNodeOutputLight"}


@dataclass
class Bench:
    """One node, all of whose outputs are read.

    ``owner``: the material, world or lamp. ``source``: an output that varies over the surface. ``shader``: an output
    of a shader. ``given``: other values of pointers, by name. ``plain``: the translation of the unlinked node.
    ``seconds``: another output of the kind of ``source`` and of ``shader``, by these: a mix of equal parts is no mix.
    """

    kind: str
    owner: Any
    node: Any
    source: Any
    shader: Any
    depsgraph: Any
    lamp: Any = None
    given: dict[str, Any] = field(default_factory=dict)
    seconds: dict[Any, Any] = field(default_factory=dict)
    plain: str | None = None

    @classmethod
    def of(cls, name: str, kind: str = "MATERIAL") -> Bench:
        """A bench for a type of node in a MATERIAL, WORLD or LIGHT."""
        from blender_addon import compat

        lamp = None
        if kind == "LIGHT":
            owner = bpy.data.lights.new("bench", "POINT")
            lamp = bpy.data.objects.new("bench", owner)
            bpy.context.scene.collection.objects.link(lamp)
        else:
            owner = (bpy.data.materials if kind == "MATERIAL" else bpy.data.worlds).new("bench")
        if kind == "MATERIAL":
            owner.displacement_method = "BOTH"
        tree = compat.use_nodes(owner)
        tree.nodes.clear()
        node = tree.nodes.new(name)
        ends = node if name in OUTPUTS.values() else tree.nodes.new(OUTPUTS[kind])
        shader = tree.nodes.new("ShaderNodeBsdfToon" if kind == "MATERIAL" else "ShaderNodeEmission").outputs[0]
        moved = tree.nodes.new("ShaderNodeVectorMath")  # not what a texture without a link has
        moved.inputs[1].default_value = (0.1, 0.2, 0.3)
        tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], moved.inputs[0])
        made = cls(kind, owner, node, moved.outputs[0], shader, bpy.context.evaluated_depsgraph_get(), lamp)
        if ends is not node:
            made._read_outputs(ends)
        return made

    def remove(self) -> None:
        """Remove the material, world or lamp."""
        kept = {"MATERIAL": bpy.data.materials, "WORLD": bpy.data.worlds, "LIGHT": bpy.data.lights}[self.kind]
        kept.remove(self.owner)

    def _read_outputs(self, ends: Any) -> None:
        """Link every output of the node to the output of the tree."""
        tree, surface = self.owner.node_tree, None
        for output in self.node.outputs:
            if output.type == "SHADER":
                if "Volume" in self.node.bl_idname:
                    tree.links.new(output, ends.inputs["Volume"])
                else:
                    surface = self._sum(surface, output)
                continue
            glow = tree.nodes.new("ShaderNodeEmission")
            tree.links.new(output, glow.inputs["Strength" if self.kind == "LIGHT" else "Color"])
            surface = self._sum(surface, glow.outputs[0])
            if "Displacement" in self.node.bl_idname:
                tree.links.new(output, ends.inputs["Displacement"])
        tree.links.new(surface or self.shader, ends.inputs["Surface"])

    def _sum(self, first: Any, second: Any) -> Any:
        if first is None:
            return second
        tree = self.owner.node_tree
        both = tree.nodes.new("ShaderNodeAddShader")
        tree.links.new(first, both.inputs[0])
        tree.links.new(second, both.inputs[1])
        return both.outputs[0]

    def translated(self) -> str:
        """Fingerprint of the translated material, world or lamp and its notes."""
        from blender_addon.translate.context import Translation
        from blender_addon.translate.ledger import note_nodes
        from blender_addon.translate.lighting.lights import translate_light
        from blender_addon.translate.lighting.world import translate_world
        from blender_addon.translate.shading.materials import translate_material

        translation = Translation.of(self.depsgraph, bpy.data)
        found: Any
        if self.kind == "WORLD":
            found = translate_world(translation, self.owner)
        elif self.kind == "LIGHT":
            lamp = self.lamp
            placed = SimpleNamespace(object=lamp, matrix_world=lamp.matrix_world, random_id=0, is_instance=False)
            found = translate_light(translation, "bench", lamp, placed)
        else:
            note_nodes(translation, self.owner.name, self.owner.node_tree)
            made = translate_material(translation, self.owner)
            found = made.material, made.filling, made.reads, made.displacement
        return fingerprint((found, translation.notes))

    def socket(self, name: str) -> Any:
        """The input that the ledger names; None if this Blender's node has none."""
        wanted = name.removeprefix("input:")
        return next((each for each in self.node.inputs if each.identifier.replace(" ", "_") == wanted), None)

    def link_all(self, but: Any = None) -> None:
        """Link every input, except one, to what varies or to a shader: the second of a type to another one."""
        tree = self.owner.node_tree
        met = set()
        for each in self.node.inputs:
            source = self.shader if each.type == "SHADER" else self.source
            if each != but:
                tree.links.new(self._second(source) if each.type in met else source, each)
                met.add(each.type)

    def _second(self, source: Any) -> Any:
        """Another output of the same kind as ``source``."""
        if source not in self.seconds:
            node = self.owner.node_tree.nodes.new(source.node.bl_idname)
            if source == self.source:
                self.owner.node_tree.links.new(source, node.inputs[0])
                node.inputs[1].default_value = (0.4, 0.1, 0.7)
            self.seconds[source] = node.outputs[0]
        return self.seconds[source]

    def unlink_all(self) -> None:
        """Remove every link to the node."""
        tree = self.owner.node_tree
        for each in [link for link in tree.links if link.to_node == self.node]:
            tree.links.remove(each)

    def changes(self, name: str, varying: bool) -> bool:
        """True if another value of a setting or input changes the translation; ``varying``: the other inputs vary."""
        struct, _, setting = name.rpartition(".")
        socket = self.socket(name) if name.startswith("input:") else None
        self.unlink_all()
        if varying:
            self.link_all(but=socket)
            before = self.translated()
        else:
            before = self.plain = self.plain or self.translated()
        if socket is not None:
            values = _other_input(self, socket)
        elif name in self.given:
            values = _other_values(self.node, name, [self.given[name]])
        else:
            values = _other_values(STRUCTS[struct][1](self.node) if struct else self.node, setting)
        changed = any(self.translated() != before for _ in values)
        values.close()  # which resets the value
        return changed

    def configurations(self) -> Iterator[tuple[str, str]]:
        """Each option of the node's lists in turn."""
        lists = [name for name in settings_of(self.node, bpy.types.ShaderNode)
                 if self.node.bl_rna.properties[name].type == "ENUM"]  # fmt: skip
        kept = {name: getattr(self.node, name) for name in lists}
        options = [(name, item.identifier) for name in lists for item in self.node.bl_rna.properties[name].enum_items]
        for first in options:
            for name, value in kept.items():
                with contextlib.suppress(TypeError):  # an option that depends on another setting
                    setattr(self.node, name, value)
            try:
                setattr(self.node, *first)
            except TypeError:
                continue
            self.plain = None
            yield first


def _other_input(bench: Bench, socket: Any) -> Generator[None]:
    """Another value of an input, or a link to it if its own value is not used."""
    value = getattr(socket, "default_value", None)
    if value is None or socket.hide_value:
        tree = bench.owner.node_tree
        link = tree.links.new(bench.shader if socket.type == "SHADER" else bench.source, socket)
        try:
            yield
        finally:
            tree.links.remove(link)
        return
    is_array = hasattr(value, "__len__") and not isinstance(value, str)
    kept = value[:] if is_array else value
    try:
        for other in [0.37, 3.7] if is_array else [other_rna(socket, "default_value"), 3.7, -3.7]:
            with contextlib.suppress(TypeError):  # a text or a whole number has one other value
                socket.default_value = tuple(other + 0.1 * i for i in range(len(value))) if is_array else other
            yield
    finally:
        socket.default_value = kept


def _other_values(owner: Any, name: str, given: list[Any] | None = None) -> Generator[None]:
    """Other values of a property: those given, each option of a list, else one value."""
    declared = owner.bl_rna.properties[name]
    kept = read_rna(owner, name)
    if given is None and declared.type == "ENUM":
        given = [item.identifier for item in declared.enum_items if item.identifier != kept]
    for option in given or [None]:
        try:
            setattr(owner, name, other_rna(owner, name) if option is None else option)
        except TypeError:
            continue
        try:
            yield
        finally:
            setattr(owner, name, kept)


def ignored(bench: Bench, names: set[str]) -> set[str]:
    """Settings and inputs of the node that change the translation in no configuration of its lists."""
    left = set(names)

    def walk(_: Any = None) -> bool:
        for varying in (False, True):
            left.difference_update({name for name in sorted(left) if bench.changes(name, varying)})
        return not left

    if not walk():
        any(map(walk, bench.configurations()))
    return left


def names_of(bench: Bench) -> set[str]:
    """Settings and inputs of the node that the ledger lists as read or noted, with those of its structs."""
    from blender_addon.translate.ledger import entries

    entry = entries()[bench.node.bl_idname]
    declared = bench.node.bl_rna.properties
    found = {name for name in entry.read | set(entry.noted) if (
        bench.socket(name) is not None if name.startswith("input:") else name in declared
    )}  # fmt: skip
    for name, (kind, get) in STRUCTS.items():
        if name.partition(".")[0] in found:
            owned = get(bench.node).bl_rna.properties
            found |= {f"{name}.{each}" for each in entries()[kind].read if each in owned}
    return found - set(STRUCTS)
