# SPDX-License-Identifier: GPL-3.0-or-later
"""A Python function as a compute node: ``module:function`` or ``file.py:function``."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.files import json_text
from spectral_core.explore.sweep.outcome import Outcome, as_outcome
from spectral_core.explore.sweep.parameters import Value
from spectral_core.files.guarded import no_file

_loading = threading.RLock()


@dataclass(frozen=True)
class FunctionNode:
    """Calls a function with the parameters by name, the ``fixed`` ones too, and ``seed`` where it takes one.

    ``function``: the function's address. ``fingerprint``: of the file that defines it, and of the fixed arguments.
    """

    function: str
    fixed: tuple[tuple[str, Value], ...] = ()
    fingerprint: str = ""
    _loaded: list[Callable[..., Any]] = field(default_factory=list, compare=False, repr=False)

    @classmethod
    def of(cls, function: str | Callable[..., Any], folder: Path | None = None, **fixed: Value) -> FunctionNode:
        """The node of a function or of its address; relative files are sought in ``folder``."""
        address = _address(function) if callable(function) else str(function)
        place, _, name = address.rpartition(":")
        if not place or not name.isidentifier():
            raise InvalidInputError(
                f"{address!r} is no address of a function; expected file.py:name or package.module:name"
            )
        if place.endswith(".py"):
            path = Path(place) if folder is None else folder / place
            address = f"{path.resolve()}:{name}"
        loaded = load_function(address)
        digest = hashlib.sha256(_source(loaded)).hexdigest()
        arguments = tuple(sorted(fixed.items()))
        print_ = hashlib.sha256(json_text([name, digest, [list(pair) for pair in arguments]]).encode()).hexdigest()
        return cls(address, arguments, print_, [loaded])

    def __call__(self, parameters: Mapping[str, Value], seed: int) -> Outcome:
        if not self._loaded:
            self._loaded.append(load_function(self.function))
        function = self._loaded[0]
        arguments = {**dict(self.fixed), **parameters}
        if "seed" not in arguments and _takes_seed(function):
            arguments["seed"] = seed
        return as_outcome(function(**arguments), self.function.rpartition(":")[2]).beside(parameters)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_loaded": []}

    def describe(self) -> list[str]:
        """Sentences for the plan of a run."""
        return [f"calls {self.function}; each worker keeps its module loaded"]


def load_function(address: str) -> Callable[..., Any]:
    """The function at an address; InvalidInputError if there is none."""
    place, _, name = address.rpartition(":")
    try:
        module = _load_file(Path(place)) if place.endswith(".py") else importlib.import_module(place)
    except InvalidInputError:
        raise
    except Exception as error:  # the code of a user may raise anything
        raise InvalidInputError(f"{place} cannot be imported: {type(error).__name__}: {error}") from error
    function = getattr(module, name, None)
    if not callable(function):
        raise InvalidInputError(f"{place} has no function {name!r}")
    return function


def _load_file(path: Path) -> Any:
    if not path.is_file():
        raise InvalidInputError(no_file(path))
    # with its content: a long-lived process, such as that of a page, must not keep a module that was edited
    said = str(path).encode() + b"\0" + path.read_bytes()
    name = f"_sweep_{hashlib.sha256(said).hexdigest()[:16]}"
    with _loading:  # another thread may be in the middle of this file
        return sys.modules[name] if name in sys.modules else _executed(name, path)


def _executed(name: str, path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InvalidInputError(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _address(function: Callable[..., Any]) -> str:
    module, name = getattr(function, "__module__", None), getattr(function, "__qualname__", "")
    if not name.isidentifier() or module is None:
        raise InvalidInputError(
            f"{function!r} is not a function at the top of a module, so workers cannot find it; move it there"
        )
    if module == "__main__":
        return f"{Path(inspect.getfile(function)).resolve()}:{name}"
    return f"{module}:{name}"


def _source(function: Callable[..., Any]) -> bytes:
    try:
        return Path(inspect.getfile(function)).read_bytes()
    except (OSError, TypeError):
        return repr(function).encode()


def _takes_seed(function: Callable[..., Any]) -> bool:
    try:
        return "seed" in inspect.signature(function).parameters
    except (TypeError, ValueError):
        return False
