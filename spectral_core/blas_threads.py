# SPDX-License-Identifier: GPL-3.0-or-later
"""BLAS on one thread while a palette or the weights of wavelengths are solved.

The matrices of a palette have tens of rows, those of wavelengths a thousand. Several threads make them hardly faster,
and on a busy machine OpenBLAS spins while it waits for its second thread: a 401-sample palette then takes ten times as
long, wavelengths take three times as long, and after each solve the second thread spins for a tenth of a second more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


@cache
def _libraries() -> tuple[Any, ...]:
    """The BLAS libraries, found once: searching them takes milliseconds, limiting them microseconds."""
    from threadpoolctl import ThreadpoolController

    return tuple(each for each in ThreadpoolController().lib_controllers if each.user_api == "blas")


class _Limit:
    """A limit for the whole process, in which several threads may solve at the same time: the first of them sets it,
    and the last one restores the number before.
    """

    def __init__(self) -> None:
        self._lock, self._solves = Lock(), 0
        self._before: list[tuple[Any, int]] = []

    @contextmanager
    def held(self, libraries: list[Any]) -> Iterator[None]:
        """Limit the libraries for the time of a block."""
        with self._lock:
            if not self._solves:
                self._before = [(library, library.num_threads) for library in libraries]
                for library in libraries:
                    _set(library, 1)
            self._solves += 1
        try:
            yield
        finally:
            with self._lock:
                self._solves -= 1
                if not self._solves:
                    for library, count in self._before:
                        _set(library, count)


def _set(library: Any, count: int) -> None:
    if library.num_threads == count:
        return
    # From version 3.8 on, threadpoolctl ignores every thread but the first that has ever set a number.
    clear = getattr(library, "clear_controlling_thread", None)
    if clear is not None:
        clear(force=True)
    library.set_num_threads(count)
    if clear is not None:
        clear()


_PROCESS = _Limit()


def on_one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Run ``function`` with BLAS limited to one thread; the previous number is restored afterward."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        # scipy has its own BLAS, which must be loaded before the libraries are searched.
        import scipy.linalg  # noqa: F401

        of_thread = [each for each in _libraries() if getattr(each, "threading_layer", "") == "openmp"]
        before = [(library, library.num_threads) for library in of_thread]
        try:
            for library in of_thread:  # OpenMP has a limit for each thread
                _set(library, 1)
            with _PROCESS.held([each for each in _libraries() if each not in of_thread]):
                return function(*args, **kwargs)
        finally:
            for library, count in before:
                _set(library, count)

    return limited
