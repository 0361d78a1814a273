# SPDX-License-Identifier: GPL-3.0-or-later
"""Every command reads each of its options; an option that is declared and never read fails the test."""

from __future__ import annotations

import argparse
import ast
import importlib
import importlib.util
import inspect
from types import ModuleType

import pytest

from blender_addon import commands
from spectral_core import cli

MODULES = cli.command_packages([commands.__name__])


def options_of(module: ModuleType) -> set[str]:
    """Attribute names of a command's options."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", action="store_true")
    module.add_arguments(parser)
    return {action.dest for action in parser._actions} - {"help", "json"}


def helpers(node: ast.ImportFrom, package: str) -> list[str]:
    """Modules of the command's package in an import statement."""
    source = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
    named = [f"{source}.{alias.name}" for alias in node.names] if source == package else [source]
    return [name for name in named if name.startswith(f"{package}.") and importlib.util.find_spec(name)]


def attributes_read(module: ModuleType) -> set[str]:
    """Attributes of ``arguments`` that a module reads, or a module of its package that it imports."""
    tree = ast.parse(inspect.getsource(module))
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "arguments":
            found.add(node.attr)
        elif isinstance(node, ast.ImportFrom):
            for helper in helpers(node, str(module.__package__)):
                found |= attributes_read(importlib.import_module(helper))
        elif isinstance(
            node, ast.FunctionDef
        ):  # getattr(arguments, name) reads the names in the function's string constants
            calls = [ast.unparse(each.func) for each in ast.walk(node) if isinstance(each, ast.Call)
                     and [ast.unparse(arg) for arg in each.args[:1]] == ["arguments"]]  # fmt: skip
            if "getattr" in calls:
                found |= {str(each.value) for each in ast.walk(node) if isinstance(each, ast.Constant)}
    return found


@pytest.mark.parametrize("name", MODULES)
def test_every_option_is_read(name: str) -> None:
    module = importlib.import_module(MODULES[name])
    if name == "demo":  # the add-on's command calls the script of the checkout
        module = importlib.import_module("examples.demo.command")
    unread = options_of(module) - attributes_read(module)
    assert not unread, f"`{name}` declares options that it never reads: {sorted(unread)}"
