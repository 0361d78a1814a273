# SPDX-License-Identifier: GPL-3.0-or-later
"""Read-only arrays of frozen data stay read-only in deep copies and pickles."""

from __future__ import annotations

import ast
import copy
import pickle
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import spectral_core
from examples.sweeps.scenes import corner
from spectral_core.scene import PointLight, scene_hash
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from spectral_core.volume.field import ScalarVolume

ROOT = Path(spectral_core.__file__).parent
FREEZING = ("frozen_array(", "setflags(", "affine(")


def arrays(item: Any, path: str = "") -> Iterator[tuple[str, np.ndarray]]:
    if isinstance(item, np.ndarray):
        yield path, item
    elif is_dataclass(item) and not isinstance(item, type):
        for each in fields(item):
            yield from arrays(getattr(item, each.name), f"{path}.{each.name}")
    elif isinstance(item, (tuple, list)):
        for number, each in enumerate(item):
            yield from arrays(each, f"{path}[{number}]")


def samples() -> dict[str, Any]:
    lamp = PointLight(name="lamp", world_from_light=np.eye(4), color=catalogue.illuminant("HP1"))
    return {
        "scene": corner(size=8, samples=1),
        "light": lamp,
        "illuminant": Illuminant("own", SpectralGrid([400.0, 500.0, 700.0]), [1.0, 2.0, 3.0]),
        "volume": ScalarVolume("own", np.arange(24.0).reshape(2, 3, 4)),
    }


@pytest.mark.parametrize("name", samples())
@pytest.mark.parametrize("copied", [copy.deepcopy, copy.copy, lambda item: pickle.loads(pickle.dumps(item))],
                         ids=["deepcopy", "copy", "pickle"])  # fmt: skip
def test_arrays_of_copies_cannot_be_written_either(name: str, copied: Any) -> None:
    """A copy could be changed, and its hash and its checks no longer held."""
    item = samples()[name]
    before, after = dict(arrays(item)), dict(arrays(copied(item)))
    assert before.keys() == after.keys()
    assert before
    for path, array in before.items():
        assert after[path].flags.writeable == array.flags.writeable, path
        np.testing.assert_array_equal(after[path], array)
    assert type(copied(item)) is type(item)
    if name == "scene":
        assert scene_hash(copied(item)) == scene_hash(item)


def test_every_frozen_dataclass_that_makes_arrays_read_only_keeps_them_so() -> None:
    missing = []
    for path in ROOT.rglob("*.py"):
        text = path.read_text("utf-8")
        for node in ast.walk(ast.parse(text)) if any(word in text for word in FREEZING) else ():
            if not isinstance(node, ast.ClassDef):
                continue
            decorators = [ast.unparse(each) for each in node.decorator_list]
            is_frozen = any(each.startswith("dataclass") and "frozen=True" in each for each in decorators)
            if is_frozen and any(word in ast.unparse(node) for word in FREEZING):
                missing += [] if "read_only_when_copied" in decorators else [f"{path.relative_to(ROOT)}: {node.name}"]
    assert missing == []
