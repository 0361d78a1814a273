# SPDX-License-Identifier: GPL-3.0-or-later
"""BLAS on one thread while a palette is solved.

The matrices of a palette have tens of rows. Several threads make them no faster, and on a busy machine OpenBLAS spins
while it waits for its second thread: a 401-sample palette then takes ten times as long.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


@cache
def _libraries() -> tuple[Any, ...]:
    """The BLAS libraries, found once: searching them takes milliseconds, limiting them microseconds."""
    from threadpoolctl import ThreadpoolController

    return tuple(each for each in ThreadpoolController().lib_controllers if each.user_api == "blas")


def on_one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Run ``function`` with BLAS limited to one thread; the previous number is restored afterward."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        # scipy has its own BLAS, which must be loaded before the libraries are searched.
        import scipy.linalg  # noqa: F401

        before = [(library, library.num_threads) for library in _libraries()]
        try:
            for library, count in before:
                if count != 1:
                    library.set_num_threads(1)
            return function(*args, **kwargs)
        finally:
            for library, count in before:
                if count != 1:
                    library.set_num_threads(count)

    return limited
