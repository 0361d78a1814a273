# SPDX-License-Identifier: GPL-3.0-or-later
"""Write docs/settings.md: every setting of the panels, and every option of the operators, as the extension declares it.

``python scripts/settings_page.py``, after a change of a setting; a test compares the page with the declarations. A
setting belongs to the panel whose file names it, and is listed under the label that this file gives it.
"""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "settings.md"
PANELS = ROOT / "blender_addon" / "panels"
SECTIONS = {
    "Palette": ("palette/*.py", {
        "The table": "SpectralPalette", "A cell": "SpectralPaletteCell", "A light": "SpectralPaletteLight",
        "A material": "SpectralPaletteMaterial", "A dye": "SpectralDye", "Possible?": "SpectralPossible",
    }),
    "Spectrum of a material, light, world or node": ("spectrum.py parts.py", {
        "": "SpectralSpectrum", "Fluorescence": "SpectralCarriedDye", "Dispersion": "SpectralDispersion",
    }),
    "Sampling and Plan": ("render.py", {"": "SpectralRender"}),
    "Look Under": ("viewport.py", {"A look": "SpectralLook", "Rendered viewports": "SpectralViewport"}),
    "Light Dial": ("dial.py", {"": "SpectralLightDial", "A bulb": "SpectralDialBulb"}),
    "Mixing Board": ("board.py", {"": "SpectralMixingBoard", "A bound number": "SpectralBoardBinding"}),
    "Sweep": ("sweep.py", {"": "SpectralSweep", "A swept setting": "SpectralSweepParameter"}),
    "Spectral Texture": ("texture.py", {"": "SpectralTextureDesign", "A wanted color": "SpectralTextureWantedColor"}),
    "Recipe": ("recipe.py", {"": "SpectralRecipe"}),
    "Spectral Volume": ("volume.py", {"": "SpectralVolume", "A material": "SpectralVolumeMaterial"}),
}  # fmt: skip
"""Title -> files of the panel, and its property groups by subtitle."""
HEAD = """# Settings of the panels

Every setting that a panel shows, and every option of an operator, by the label in the panel and with the text of the
tooltip. The default among choices is in bold type. *In Python* is the name of the setting in a script, and the word
after the name of a choice is its value there. What the features do is on their own pages: [the
palette](palette_in_blender.md), [the viewport](viewport.md), [the light dial](relight.md), [sweeps](explore.md),
[textures and recipes](spectral_textures.md), [volumes](volume_files.md#in-blender), [renders](render.md).

`python scripts/settings_page.py` writes this page.
"""


def drawn(words: str) -> tuple[set[str], dict[str, str]]:
    """Texts that the files of a panel contain, and the labels that they give to settings instead of their names."""
    texts: set[str] = set()
    labels: dict[str, set[str]] = {}
    files = [file for word in words.split() for file in sorted(PANELS.glob(word))]
    for node in (node for file in files for node in ast.walk(ast.parse(file.read_text("utf-8")))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts.add(node.value)
        if isinstance(node, ast.Call) and len(node.args) > 1 and isinstance(node.args[1], ast.Constant):
            text = next((word.value for word in node.keywords if word.arg == "text"), None)
            label = text.value if isinstance(text, ast.Constant) else ""
            labels.setdefault(str(node.args[1].value), set()).add(str(label))
    return texts, {setting: next(iter(each)) for setting, each in labels.items() if len(each) == 1}


def default_of(prop: Any) -> str:
    """The choices of a setting with the default in bold, or its default and range."""
    if prop.type == "ENUM":
        usual = prop.default_flag if prop.is_enum_flag else {prop.default}
        names = [
            f"{f'**{item.name}**' if item.identifier in usual else f'*{item.name}*'} `{item.identifier}`"
            for item in prop.enum_items
        ]
        told = zip(names, prop.enum_items, strict=True)
        return "; ".join(f"{name}: {item.description}" if item.description else name for name, item in told)
    if prop.type == "BOOLEAN":
        return "on" if prop.default else "off"
    if prop.type in ("INT", "FLOAT") and not prop.is_array:
        low, high = (number(value) for value in (prop.hard_min, prop.hard_max))
        span = f"{low} to {high}" if low and high else f"from {low}" if low else f"to {high}" if high else ""
        return f"{number(prop.default)}, {span}".removesuffix(", ")
    return f"`{prop.default}`" if prop.type == "STRING" and prop.default else ""


def number(value: float) -> str:
    """A number as text; empty for one that is no limit."""
    return "" if abs(value) > 1e9 else f"{round(value):,}" if abs(value) >= 1e4 else f"{value:.6g}"


def declared(kind: type, properties: Any) -> Iterator[Any]:
    """The settings of a property group or operator that have a name of their own."""
    for setting in inspect.get_annotations(kind):
        prop = properties.get(setting)
        if prop is not None and prop.name not in (setting, ""):
            yield prop


ROOTS = {"Scene": "bpy.context.scene", "Material": "material", "Volume": "volume"}
"""Data-blocks that hold the groups of the page, and their names in a script; lights, worlds and nodes hold a spectrum
as materials do."""


def places() -> dict[str, str]:
    """How a script reaches each property group, such as ``bpy.context.scene.spectral.palette``, by its class."""
    import bpy

    found: dict[str, str] = {}
    left = [(name, getattr(bpy.types, kind).bl_rna.properties["spectral"]) for kind, name in ROOTS.items()]
    while left:  # the shortest ways first
        owner, prop = left.pop(0)
        place = f"{owner}.{prop.identifier}{'[0]' if prop.type == 'COLLECTION' else ''}"
        if prop.fixed_type.identifier.startswith("Spectral") and prop.fixed_type.identifier not in found:
            found[prop.fixed_type.identifier] = place
            inner = (each for each in prop.fixed_type.properties if each.type in ("POINTER", "COLLECTION"))
            left += [(place, each) for each in inner if each.identifier != "rna_type"]
    return found


def table_of(name: str, texts: set[str], labels: dict[str, str]) -> list[str]:
    """The settings of a property group that a panel names, after its place; empty if there are none."""
    import bpy

    group = next(kind for kind in bpy.types.PropertyGroup.__subclasses__() if kind.__name__ == name)
    lines = [
        f"| {labels.get(prop.identifier) or prop.name} | `{prop.identifier}` | {default_of(prop)} "
        f"| {prop.description} |"
        for prop in declared(group, group.bl_rna.properties)
        if prop.identifier in texts
    ]
    head = [
        "",
        f"In Python: `{places()[name]}`",
        "",
        "| setting | in Python | default, range or choices | meaning |",
        "|---|---|---|---|",
    ]
    return head + lines if lines else []


def operators() -> list[tuple[str, type, Any]]:
    """Name after ``bpy.ops.spectral``, class and properties of every operator, by their labels."""
    import bpy

    known = {kind.__name__: kind for kind in bpy.types.Operator.__subclasses__()}
    known |= {below.__name__: below for kind in known.values() for below in kind.__subclasses__()}
    own = [kind for kind in known.values() if str(getattr(kind, "bl_idname", "")).startswith("spectral.")]
    names = {kind: kind.bl_idname.partition(".")[2] for kind in own}
    made = [(name, kind, getattr(bpy.ops.spectral, name).get_rna_type()) for kind, name in names.items()]
    return sorted(made, key=lambda each: (each[2].name, each[0]))


def page() -> str:
    """The text of the page, from the declarations of the registered extension."""
    lines = [HEAD.rstrip()]
    for title, (files, groups) in SECTIONS.items():
        texts, labels = drawn(files)
        lines += ["", f"## {title}"]
        for subtitle, group in groups.items():
            table = table_of(group, texts, labels)
            lines += (["", f"### {subtitle}"] if subtitle and table else []) + table
    lines += ["", "## Operators", "", "From Python they are called as `bpy.ops.spectral.plan()`.", ""]
    lines += ["| operator | `bpy.ops.spectral.` | does |", "|---|---|---|"]
    lines += [f"| {made.name} | `{name}` | {' '.join(made.description.split())} |" for name, _, made in operators()]
    lines += ["", "## Options of operators", ""]
    lines += ["| operator | option | in Python | default, range or choices | meaning |", "|---|---|---|---|---|"]
    for name, kind, made in operators():
        for prop in declared(kind, made.properties):
            where = f"{made.name} (`{name}`) | {prop.name} | `{prop.identifier}`"
            lines.append(f"| {where} | {default_of(prop)} | {prop.description} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Write the page."""
    import blender_addon

    blender_addon.register()
    PAGE.write_text(page(), "utf-8")
    print(f"wrote {PAGE}")
    return 0


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    from spectral_core.cli.shared.terminal import completed

    sys.exit(completed(main))
