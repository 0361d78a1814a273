# SPDX-License-Identifier: GPL-3.0-or-later
"""The render process: reads scenes from its standard input, writes pictures to its standard output.

It lives as long as the session that started it: when its input closes, for any reason, it ends at once.
"""

from __future__ import annotations

import gc
import queue
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from spectral_core.errors import RenderError, SpectralError
from spectral_core.render.process import serving

Tell = Callable[[Any], None]
"""Sends an answer to the session."""


def main() -> None:
    """Serve render requests until the input closes."""
    requests: queue.SimpleQueue[Any] = queue.SimpleQueue()
    stop = threading.Event()

    def hear(message: tuple[str, Any]) -> None:
        """Pass requests on, and recognize "stop" during a render, or before it: the end of the last one takes time."""
        if message[0] == "stop":
            stop.set()
        else:
            stop.clear()
            requests.put(message)

    tell = serving.begin(hear)
    is_loaded = False
    while True:
        kind, content = requests.get()
        if kind == "call":
            _answer_with(tell, partial(call, *content))
        else:
            scene, options = content
            _answer(tell, scene, options, stop)
            del scene, options
        del content
        gc.collect()
        if not is_loaded:
            # The renderer's modules, which the first request imports, live as long as the process: later collections
            # need not walk over them, which takes some 30 ms each.
            gc.freeze()
            is_loaded = True


def call(name: str, arguments: tuple[Any, ...]) -> Any:
    """Answer a request for data on a scene: its plan or its cost curve."""
    from spectral_core.render.cost.curve import cost_curve
    from spectral_core.render.cost.fixed import plan_at

    known: dict[str, Callable[..., Any]] = {"plan": plan_at, "cost": cost_curve}
    return known[name](*arguments)


def _answer(tell: Tell, scene: Any, options: dict[str, Any], stop: threading.Event) -> None:
    from spectral_core.render.still import render_scene

    _answer_with(
        tell,
        lambda: render_scene(
            scene,
            on_progress=lambda progress: tell(("progress", progress)),
            should_stop=stop.is_set,
            **options,
        ),
    )


def _answer_with(tell: Tell, answer: Callable[[], Any]) -> None:
    """Send the result of ``answer``, or the error that it raises."""
    try:
        tell(("done", answer()))
    except SpectralError as error:
        tell(("error", (type(error).__name__, str(error))))
    except MemoryError:
        tell(("error", (RenderError.__name__, "the render process ran out of memory")))
    except Exception as error:
        import traceback

        traceback.print_exc()
        tell(("error", (RenderError.__name__, f"the renderer failed: {type(error).__name__}: {error}")))


if __name__ == "__main__":
    main()
