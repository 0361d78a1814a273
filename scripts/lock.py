# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes requirements.lock: every package of constraints.txt with the hashes of its files, for any platform.

Run it after a change of pyproject.toml or constraints.txt: ``python scripts/lock.py``. It uses uv in a temporary
environment.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HEAD = """# Written by scripts/lock.py from pyproject.toml and constraints.txt; do not edit.
# SPDX-License-Identifier: GPL-3.0-or-later
"""


UNLOCKED = {"denoise"}
"""Extras too heavy for every set-up."""


def extras() -> list[str]:
    """The extras that the lock file holds."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    return [name for name in declared if name not in UNLOCKED]


def main() -> None:
    """Resolve, and write the lock file."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = Path(folder) / "bin" / "python"
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", "uv"], check=True)
        out = Path(folder) / "requirements.lock"
        line = [
            str(python.with_name("uv")),
            "pip",
            "compile",
            "--quiet",
            "pyproject.toml",
            *(word for extra in extras() for word in ("--extra", extra)),
            "--universal",
        ]
        line += ["--generate-hashes", "--constraint", "constraints.txt", "--python-version", "3.11"]
        line += ["--no-header", "--no-annotate", "--output-file", str(out)]
        if subprocess.run(line, cwd=ROOT).returncode:
            sys.exit("lock: uv found no set of versions; its output is above")
        text = out.read_text("utf-8")
    (ROOT / "requirements.lock").write_text(HEAD + text, "utf-8")
    print(f"lock: {text.count('==')} packages, {text.count('--hash')} hashes")


if __name__ == "__main__":
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # a closed output ends the program without a message
    main()
