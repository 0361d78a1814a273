# SPDX-License-Identifier: GPL-3.0-or-later
"""How long the extension holds up Blender's main thread: each of its calls, and the gaps of a timer.

Python reports every call of a function of the extension and its return (``sys.monitoring``). What Blender calls on its
main thread - panels, operators, handlers, timers, callbacks of properties, the engine - is timed from there to its
return, on the clock and in processor time of the thread. A timer that ticks at ``TICK_S`` gives a trace of what the
artist feels, Blender's own work included.
"""

import faulthandler
import os
import resource
import sys
import tempfile
import threading
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import bpy

TICK_S = 0.01
STANDS_S = 0.12
"""After this time in a call the places of all threads are written down, without waiting for Python's lock."""
SLOW_MS = 60.0
"""Calls that take longer are listed one by one."""
monitoring: Any = sys.monitoring  # type: ignore[attr-defined]  # Python 3.12 and later, as in Blender 5
DISABLE = monitoring.DISABLE  # None at the end of Python, where modules have lost their contents
step = ["start"]
"""What the script does now."""


def _queue_file():
    """Linux' account of the main thread's waits for a processor, kept open; None elsewhere."""
    try:
        return os.open(f"/proc/self/task/{threading.get_native_id()}/schedstat", os.O_RDONLY)
    except OSError:
        return None


def host_took_ms() -> float:
    """Milliseconds since the start of the machine in which its host ran something else on the processor that lost most,
    in steps of 10 ms; 0 outside virtual machines and Linux.
    """
    try:
        lines = Path("/proc/stat").read_text().splitlines()
    except OSError:
        return 0.0
    rows = [line.split() for line in lines if line.startswith("cpu") and line[3].isdigit()]
    return max((1e3 * float(row[8]) / os.sysconf("SC_CLK_TCK") for row in rows), default=0.0)


class Trace:
    """Outermost calls of the extension on the main thread: by function milliseconds on the clock and of processor time,
    the step, and milliseconds in which no processor was free. ``since``: milliseconds and functions since they were
    cleared.
    """

    def __init__(self):
        self.calls = defaultdict(list)
        self.within, self.since, self.stood, self.slow = 0.0, [], [], []
        self.host_took = host_took_ms()
        self._places = tempfile.TemporaryFile("w+b", 0)  # noqa: SIM115 - kept open for the process
        self._main, self._depth, self._start = threading.get_ident(), 0, (0.0, 0.0, 0.0)
        self._queue = _queue_file()
        events = monitoring.events
        pairs = {
            "PY_START": self._enter, "PY_RESUME": self._enter, "PY_RETURN": self._leave, "PY_YIELD": self._leave,
            "PY_UNWIND": self._unwind, "PY_THROW": self._thrown,
        }  # fmt: skip
        self._tool = monitoring.PROFILER_ID
        monitoring.use_tool_id(self._tool, "stalls")
        for name, call in pairs.items():
            monitoring.register_callback(self._tool, getattr(events, name), call)
        monitoring.set_events(self._tool, sum(getattr(events, name) for name in pairs))

    def clear(self):
        """Forget all calls."""
        self.calls.clear()
        self.stood.clear()
        self.slow.clear()

    def _enter(self, code, _place):
        if "blender_addon" not in code.co_filename:
            return DISABLE
        if threading.get_ident() == self._main:
            if not self._depth:
                faulthandler.dump_traceback_later(STANDS_S, file=self._places)
                self._start = time.perf_counter(), time.thread_time(), self._queued()
                self._faults = resource.getrusage(resource.RUSAGE_THREAD).ru_majflt
            self._depth += 1
        return None

    def _leave(self, code, _place, _value):
        if "blender_addon" not in code.co_filename:
            return DISABLE
        if threading.get_ident() == self._main and self._depth:
            self._depth -= 1
            if not self._depth:
                clock = 1e3 * (time.perf_counter() - self._start[0])
                work = 1e3 * (time.thread_time() - self._start[1])
                queued = 1e3 * (self._queued() - self._start[2])
                self.within += clock
                name = f"{code.co_filename.rpartition('blender_addon/')[2]}: {code.co_qualname}"
                faulthandler.cancel_dump_traceback_later()
                self.calls[name].append((clock, work, step[0], queued))
                self.since.append((clock, name))
                if clock > SLOW_MS:
                    took = host_took_ms() - self.host_took
                    self.slow.append({"name": name, "step": step[0], "clock_ms": clock, "work_ms": work,
                                      "queued_ms": queued, "host_took_ms": took})  # fmt: skip
                if self._places.tell():
                    self._write_down(name, clock)
        return None

    def _write_down(self, name, clock):
        """Keep the places of the threads that were written during the call."""
        read = resource.getrusage(resource.RUSAGE_THREAD).ru_majflt - self._faults
        self._places.seek(0)
        self.stood.append({"name": name, "step": step[0], "clock_ms": clock, "pages_read": read,
                           "threads": self._places.read().decode()})  # fmt: skip
        self._places.seek(0)
        self._places.truncate()

    def _queued(self):
        """Seconds in which the main thread could have run, but no processor was free; 0 where this is not reported."""
        return 0.0 if self._queue is None else int(os.pread(self._queue, 100, 0).split()[1]) / 1e9

    def _unwind(self, code, place, error):
        if "blender_addon" in code.co_filename:
            self._leave(code, place, error)

    def _thrown(self, code, place, _error):
        if "blender_addon" in code.co_filename:
            self._enter(code, place)


class Ticks:
    """A timer's trace: for each gap between two calls its milliseconds, those of the extension in it, the step, and the
    three longest calls of the extension.
    """

    def __init__(self, trace):
        self.gaps, self._trace, self._last, self._within = [], trace, None, 0.0
        bpy.app.timers.register(self.tick, persistent=True)

    def tick(self):
        self._trace.host_took = host_took_ms()
        now, within = time.perf_counter(), self._trace.within
        if self._last is not None:
            longest = sorted(self._trace.since, reverse=True)[:3]
            self.gaps.append((1e3 * (now - self._last), within - self._within, step[0], longest))
        self._last, self._within = now, within
        self._trace.since.clear()
        return TICK_S
