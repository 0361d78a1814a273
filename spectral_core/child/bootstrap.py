# SPDX-License-Identifier: GPL-3.0-or-later
"""Start of a child process: set the parent's module path, then run the named module."""

import json  # the standard library's: the interpreter was started with -P and -s
import os
import runpy
import sys


def _run() -> None:
    sys.path[:] = json.loads(os.environ["SPECTRAL_SCENE_SYS_PATH"])
    module = sys.argv[1]
    sys.argv[:] = sys.argv[1:]
    runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _run()
