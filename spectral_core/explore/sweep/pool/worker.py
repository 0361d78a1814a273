# SPDX-License-Identifier: GPL-3.0-or-later
"""A worker process that keeps loaded data: tasks from standard input, answers to standard output, until that closes."""

from __future__ import annotations

import faulthandler
import os
import pickle
import signal
import sys
import traceback

from spectral_core.errors import RenderError
from spectral_core.explore.sweep.pool.executor import MARKER
from spectral_core.render.process.messages import receive, send


def main() -> None:
    """Serve tasks. The end of the driver is detected after the present task, which is committed first."""
    faulthandler.enable()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the driver handles Ctrl-C
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of libraries goes to the log, not between the messages
    _limit_threads()
    answers.write(MARKER)
    answers.flush()
    while True:
        try:
            function, arguments, options = receive(sys.stdin.buffer)
        except EOFError:
            return
        except Exception as error:  # a task that cannot be unpickled: report it; the stream is at the next message
            _answer(answers, False, _plain(error))
            continue
        try:
            result = function(*arguments, **options)
        except Exception as error:
            _answer(answers, False, _plain(error))
        else:
            _answer(answers, True, result)


def _answer(answers: object, succeeded: bool, content: object) -> None:
    try:
        send(answers, (succeeded, content))  # type: ignore[arg-type]
    except (BrokenPipeError, OSError):
        os._exit(0)  # the driver has ended; the computed outcome is committed
    except Exception as error:
        send(answers, (False, _plain(error)))  # type: ignore[arg-type]


def _plain(error: Exception) -> Exception:
    """The error if it can be pickled, else one with its text."""
    traceback.print_exc()
    try:
        pickle.loads(pickle.dumps(error))
        return error
    except Exception:
        return RenderError(f"{type(error).__name__}: {error}")


def _limit_threads() -> None:
    """Give Dr.Jit as many threads as this worker may use, when it is loaded."""
    threads = os.environ.get("SPECTRAL_SCENE_THREADS")
    if not threads:
        return
    try:
        import drjit

        drjit.set_thread_count(max(1, int(threads) - 1))
    except (ImportError, AttributeError, ValueError):
        return


if __name__ == "__main__":
    main()
