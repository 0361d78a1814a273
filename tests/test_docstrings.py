# SPDX-License-Identifier: GPL-3.0-or-later
"""A docstring's ``Parameters`` section names the parameters that the signature has, in its order, and no others."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_SECTION = re.compile(r"^(\s*)Parameters\n\s*-{3,}\n(.*?)(?=\n\s*\n\s*[A-Z]\w+\n\s*-{3,}|\Z)", re.MULTILINE | re.DOTALL)


def functions() -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef, str]]:
    """Position, node and docstring of everything with a docstring, in files where one may have sections."""
    for folder in ("spectral_core", "blender_addon", "benchmarks", "scripts", "examples"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            source = path.read_text("utf-8")
            if "---" not in source:  # no section can be there, and most files have none
                continue
            for node in ast.walk(ast.parse(source)):
                if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                    text = ast.get_docstring(node)
                    if text:
                        yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", node, text


def documented(text: str) -> list[str] | None:
    """Names in a numpy-style Parameters section; None without one."""
    found = _SECTION.search(text)
    if found is None:
        return None
    lines = [line for line in found[2].splitlines() if line.strip()]
    depth = min(len(line) - len(line.lstrip()) for line in lines)
    heads = [line.strip() for line in lines if len(line) - len(line.lstrip()) == depth]
    return [name.strip().lstrip("*") for head in heads for name in head.partition(" :")[0].split(",")]


def stated(node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> list[str]:
    """Parameters of a function without self and cls; for a class those of __init__, or its fields."""
    if isinstance(node, ast.ClassDef):
        for member in node.body:
            if isinstance(member, ast.FunctionDef) and member.name == "__init__":
                return stated(member)
        return [
            each.target.id
            for each in node.body
            if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name)
        ]
    given = node.args
    named = [
        *given.posonlyargs,
        *given.args,
        *filter(None, [given.vararg]),
        *given.kwonlyargs,
        *filter(None, [given.kwarg]),
    ]
    return [each.arg for each in named if each.arg not in ("self", "cls")]


def test_documented_parameters_are_those_of_the_signature() -> None:
    wrong = {}
    sections = 0
    for place, node, text in functions():
        names = documented(text)
        if names is None:
            continue
        sections += 1
        if names != stated(node):
            wrong[place] = (names, stated(node))

    assert sections > 20
    assert wrong == {}


def test_headings_of_sections_are_on_separate_lines() -> None:
    broken = re.compile(r"\b(Parameters|Returns|Raises|Yields|Attributes)[ \t]+-{3,}")
    assert [place for place, _, text in functions() if broken.search(text)] == []
