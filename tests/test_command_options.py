# SPDX-License-Identifier: GPL-3.0-or-later
"""Every option of every command is read by it: one that is declared and forgotten fails here."""

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
    """Names under which a command's options arrive."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", action="store_true")
    module.add_arguments(parser)
    return {action.dest for action in parser._actions} - {"help", "json"}


def helpers(node: ast.ImportFrom, package: str) -> list[str]:
    """Modules of the command's own package that an import names."""
    source = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
    named = [f"{source}.{alias.name}" for alias in node.names] if source == package else [source]
    return [name for name in named if name.startswith(f"{package}.") and importlib.util.find_spec(name)]


def attributes_read(module: ModuleType) -> set[str]:
    """Attributes of ``arguments`` that a module, or another of its package that it imports, reads."""
    tree = ast.parse(inspect.getsource(module))
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "arguments":
            found.add(node.attr)
        elif isinstance(node, ast.ImportFrom):
            for helper in helpers(node, str(module.__package__)):
                found |= attributes_read(importlib.import_module(helper))
        elif isinstance(node, ast.FunctionDef):  # getattr(arguments, name) reads names that the function lists
            calls = [ast.unparse(each.func) for each in ast.walk(node) if isinstance(each, ast.Call)
                     and [ast.unparse(arg) for arg in each.args[:1]] == ["arguments"]]  # fmt: skip
            if "getattr" in calls:
                found |= {str(each.value) for each in ast.walk(node) if isinstance(each, ast.Constant)}
    return found


@pytest.mark.parametrize("name", MODULES)
def test_every_option_is_read(name: str) -> None:
    module = importlib.import_module(MODULES[name])
    if name == "demo":  # the add-on's command hands over to the script of the checkout
        module = importlib.import_module("examples.demo.command")
    unread = options_of(module) - attributes_read(module)
    assert not unread, f"`{name}` declares options that it never reads: {sorted(unread)}"
