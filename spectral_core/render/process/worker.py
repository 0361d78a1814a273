# SPDX-License-Identifier: GPL-3.0-or-later
"""The render process: reads scenes from its standard input, writes pictures to its standard output.

It lives as long as the session that started it: when its input closes, for any reason, it ends at once.
"""

from __future__ import annotations

import faulthandler
import gc
import os
import queue
import signal
import sys
import threading
from collections.abc import Callable
from functools import partial
from typing import Any, BinaryIO

from spectral_core.child import lower_priority
from spectral_core.errors import RenderError, SpectralError
from spectral_core.render.process.messages import receive, send


def main() -> None:
    """Serve render requests until the input closes."""
    faulthandler.enable()
    lower_priority()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the session handles Ctrl-C
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of libraries goes to the log, not between the messages
    requests: queue.SimpleQueue[Any] = queue.SimpleQueue()
    stop = threading.Event()
    threading.Thread(target=_listen, args=(sys.stdin.buffer, requests, stop), daemon=True).start()
    send(answers, ("ready", os.getpid()))
    is_loaded = False
    while True:
        kind, content = requests.get()
        stop.clear()
        if kind == "call":
            _answer_with(answers, partial(call, *content))
        else:
            scene, options = content
            _answer(answers, scene, options, stop)
            del scene, options
        del content
        gc.collect()
        if not is_loaded:
            # The renderer's modules, which the first request imports, live as long as the process: later collections
            # need not walk over them, which takes some 30 ms each.
            gc.freeze()
            is_loaded = True


def _listen(stream: BinaryIO, requests: queue.SimpleQueue[Any], stop: threading.Event) -> None:
    """Pass requests on, and recognize "stop" during a render."""
    while True:
        try:
            kind, content = receive(stream)
        except (EOFError, OSError):
            os._exit(0)  # the session has ended; a running render has no reader
        if kind == "stop":
            stop.set()
        else:
            requests.put((kind, content))


def call(name: str, arguments: tuple[Any, ...]) -> Any:
    """Answer a request for data on a scene: its plan or its cost curve."""
    from spectral_core.render.cost.curve import cost_curve
    from spectral_core.render.plan.effects import plan_effects

    known: dict[str, Callable[..., Any]] = {"plan": plan_effects, "cost": cost_curve}
    return known[name](*arguments)


def _answer(answers: BinaryIO, scene: Any, options: dict[str, Any], stop: threading.Event) -> None:
    from spectral_core.render.still import render_scene

    _answer_with(
        answers,
        lambda: render_scene(
            scene,
            on_progress=lambda progress: send(answers, ("progress", progress)),
            should_stop=stop.is_set,
            **options,
        ),
    )


def _answer_with(answers: BinaryIO, answer: Callable[[], Any]) -> None:
    """Send the result of ``answer``, or the error that it raises."""
    try:
        send(answers, ("done", answer()))
    except SpectralError as error:
        send(answers, ("error", (type(error).__name__, str(error))))
    except (BrokenPipeError, EOFError):
        os._exit(0)
    except MemoryError:
        send(answers, ("error", (RenderError.__name__, "the render process ran out of memory")))
    except Exception as error:
        import traceback

        traceback.print_exc()
        send(answers, ("error", (RenderError.__name__, f"the renderer failed: {type(error).__name__}: {error}")))


if __name__ == "__main__":
    main()
