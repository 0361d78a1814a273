# SPDX-License-Identifier: GPL-3.0-or-later
"""BLAS has one thread while any palette is solved, whichever thread solves it, and its own number afterward."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
import scipy.linalg  # noqa: F401
from threadpoolctl import threadpool_info, threadpool_limits

from spectral_core.blas_threads import on_one_thread


def numbers() -> set[int]:
    """Threads of the BLAS libraries."""
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def two_threads() -> Iterator[None]:
    with threadpool_limits(2, user_api="blas"):
        if numbers() == {1}:
            pytest.skip("BLAS was built for one thread")
        yield


def test_every_thread_of_python_can_limit() -> None:
    """The first one alone could: in Blender's window, where a thread solves, BLAS had two."""
    assert on_one_thread(numbers)() == {1}
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(on_one_thread(numbers)).result() == {1}
    assert 2 in numbers()


def test_solves_that_overlap_share_the_limit() -> None:
    """The end of the first of two solves does not end the limit of the other."""
    begun, ended = threading.Event(), threading.Event()

    @on_one_thread
    def longer() -> set[int]:
        begun.set()
        assert ended.wait(20)
        return numbers()

    @on_one_thread
    def shorter() -> set[int]:
        assert begun.wait(20)
        return numbers()

    with ThreadPoolExecutor(2) as pool:
        answers = [pool.submit(longer), pool.submit(shorter)]
        assert answers[1].result() == {1}
        ended.set()
        assert answers[0].result() == {1}
    assert 2 in numbers()
