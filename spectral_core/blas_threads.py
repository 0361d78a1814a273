# SPDX-License-Identifier: GPL-3.0-or-later
"""BLAS on one thread while a palette or the weights of wavelengths are solved.

The matrices of a palette have tens of rows, those of wavelengths a thousand. Several threads make them hardly faster,
and on a busy machine OpenBLAS spins while it waits for its second thread: a 401-sample palette then takes ten times as
long, wavelengths take three times as long, and after each solve the second thread spins for a tenth of a second more.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
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


def wait_without_spinning() -> None:
    """Let OpenBLAS libraries that are loaded from now on wait for work without spinning, in this process and in its
    children.

    The second thread of a product spins for a tenth of a second more by default. Where the processor draws the windows,
    too, it takes the time of the redraw that shows the product.
    """
    os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "4")  # the logarithm of the number of cycles; 4 is the least


class _Limit:
    """A limit for the whole process, in which several threads may solve at the same time: the first of them sets it,
    and the last one restores the number before.
    """

    def __init__(self) -> None:
        self._lock, self._solves = Lock(), 0
        self._before: list[tuple[Any, int]] = []

    def begin(self, libraries: Sequence[Any]) -> None:
        """Limit the libraries until ``end``."""
        with self._lock:
            if not self._solves:
                self._before = _limited(libraries)
            self._solves += 1

    def end(self) -> None:
        """Restore the numbers, if no other thread solves."""
        with self._lock:
            self._solves -= 1
            if not self._solves:
                _restore(self._before)


def _limited(libraries: Sequence[Any]) -> list[tuple[Any, int]]:
    """Limit the libraries; returns the numbers of those that had more threads."""
    # A call of a library takes a microsecond or two, which an edit of a palette would notice.
    numbers = [(library, library.num_threads) for library in libraries]
    before = [(library, number) for library, number in numbers if number != 1]
    for library, _ in before:
        _set(library, 1)
    return before


def _restore(before: Sequence[tuple[Any, int]]) -> None:
    for library, number in before:
        _set(library, number)


def _set(library: Any, count: int) -> None:
    # From version 3.8 on, threadpoolctl ignores every thread but the first that has ever set a number.
    clear = getattr(library, "clear_controlling_thread", None)
    if clear is not None:
        clear(force=True)
    library.set_num_threads(count)
    if clear is not None:
        clear()


_PROCESS = _Limit()


@cache
def _kinds() -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """The libraries whose limit is of the process, and those of OpenMP, which have one for each thread."""
    of_thread = tuple(each for each in _libraries() if getattr(each, "threading_layer", "") == "openmp")
    return tuple(each for each in _libraries() if each not in of_thread), of_thread


def on_one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Run ``function`` with BLAS limited to one thread; the previous number is restored afterward."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        # scipy has its own BLAS, which must be loaded before the libraries are searched.
        import scipy.linalg  # noqa: F401

        of_process, of_thread = _kinds()
        before = _limited(of_thread)
        try:
            _PROCESS.begin(of_process)
            try:
                return function(*args, **kwargs)
            finally:
                _PROCESS.end()
        finally:
            _restore(before)

    return limited
