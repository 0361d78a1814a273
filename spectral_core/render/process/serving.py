# SPDX-License-Identifier: GPL-3.0-or-later
"""How a process serves the session that has started it: messages come by its standard input, answers leave by its
standard output.

When the input closes, for any reason, the process ends at once: nobody would read an answer.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from functools import partial
from typing import Any, BinaryIO

from spectral_core.child import lower_priority
from spectral_core.render.process.messages import receive, send


def begin(hear: Callable[[Any], None]) -> Callable[[Any], None]:
    """Tell the session that this process is ready, and call ``hear`` with its messages, on a thread.

    Returns the function that sends an answer; it may be called from any one thread at a time.
    """
    faulthandler.enable()
    lower_priority()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the session handles Ctrl-C
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of libraries goes to the log, not between the messages
    threading.Thread(target=_listen, args=(sys.stdin.buffer, hear), daemon=True).start()
    tell = partial(_tell, answers)
    tell(("ready", os.getpid()))
    return tell


def _listen(stream: BinaryIO, hear: Callable[[Any], None]) -> None:
    while True:
        try:
            hear(receive(stream))
        except (EOFError, OSError):
            os._exit(0)  # the session has ended
        except Exception:  # noqa: BLE001 - the rest of the stream means nothing; the session starts another process
            traceback.print_exc()
            os._exit(1)


def _tell(answers: BinaryIO, message: Any) -> None:
    try:
        send(answers, message)
    except OSError:
        os._exit(0)
