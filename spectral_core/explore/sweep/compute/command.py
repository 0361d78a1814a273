# SPDX-License-Identifier: GPL-3.0-or-later
"""A command line with a template as a compute node: any program that takes numbers and leaves results.

The template is a list of words, or one text that is split into words once; {name} stands for a parameter, {seed},
{out} for a fresh folder. No shell sees it, so a value is always one word. Results: the last line of standard output
where it is a JSON object or a number, ``result.json`` in the folder, and pictures that the program left there.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from spectral_core.errors import InvalidInputError, MissingDependencyError, RenderError
from spectral_core.explore.sweep.files import json_text
from spectral_core.explore.sweep.outcome import Outcome, join_values
from spectral_core.explore.sweep.parameters import Space, Value
from spectral_core.files.of_process import temporary_folder

_PLACE = re.compile(r"\{([^{}]*)\}")
PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".exr")
MAX_OUTPUT_BYTES = 50_000_000
MOST_PICTURES = 8
TIME_LIMIT_S = 3600.0


@dataclass(frozen=True)
class CommandNode:
    """Runs a program per point. ``words``: the template; ``folder``: where it runs; ``limit_s``: its longest time."""

    words: tuple[str, ...]
    folder: str = "."
    limit_s: float = TIME_LIMIT_S
    fingerprint: str = ""

    @classmethod
    def of(
        cls, template: str | list[str], space: Space, folder: Path | None = None, *, limit_s: float = TIME_LIMIT_S
    ) -> CommandNode:
        """The node of a template; checks its places against the parameters.

        Parameters
        ----------
        template : words, or one text that is split as a POSIX shell splits words.
        space : the parameters.
        folder : where the program runs.
        limit_s : longest time of a point in seconds.
        """
        words = tuple(shlex.split(template) if isinstance(template, str) else [str(word) for word in template])
        if not words:
            raise InvalidInputError("the command is empty; expected a program and its arguments")
        if "out" in space.names:
            raise InvalidInputError("a parameter is named 'out', as the folder of a command's results is; rename it")
        known = {*space.names, "seed", "out"}
        used = {place for word in words for place in _PLACE.findall(word)}
        strange = sorted(used - known)
        if strange:
            raise InvalidInputError(f"the command has the place {{{strange[0]}}}; known are {', '.join(sorted(known))}")
        missing = sorted(set(space.names) - used)
        if missing:
            raise InvalidInputError(f"the command never uses {missing[0]!r}; write {{{missing[0]}}} where it belongs")
        node = cls(words, str((folder or Path()).resolve()), float(limit_s))
        named = (text for word in words for text in _chosen(word, space))
        files = {text: content for text in named if (content := _content(Path(node.folder), text))}
        return replace(node, fingerprint=hashlib.sha256(json_text([list(words), files]).encode()).hexdigest())

    def __call__(self, parameters: Mapping[str, Value], seed: int) -> Outcome:
        with _fresh_folder() as out:
            # a swept seed replaces that of the sweep
            known = {"seed": str(seed), "out": out, **{name: _word(value) for name, value in parameters.items()}}
            words = [_PLACE.sub(lambda match: known[match.group(1)], word) for word in self.words]
            done = self._run(words)
            if done.returncode != 0:
                raise RenderError(_failure(words[0], done))
            values = _values(done.stdout, Path(out))
            pictures = sorted(
                path for path in Path(out).iterdir() if path.suffix.lower() in PICTURES and path.is_file()
            )
            files = {}
            too_large = [path.name for path in pictures if path.is_symlink() or path.stat().st_size > MAX_OUTPUT_BYTES]
            if too_large or len(pictures) > MOST_PICTURES:
                raise RenderError(
                    f"{words[0]} left {len(pictures)} pictures in {{out}}; a point keeps at most {MOST_PICTURES}, each "
                    f"a plain file of at most {MAX_OUTPUT_BYTES / 1e6:.0f} MB"
                    + (f", and {too_large[0]} is not" if too_large else "")
                )
            for number, path in enumerate(pictures):
                files[("" if number == 0 else f"_{number}") + path.suffix.lower()] = path.read_bytes()
            if not values and not files:
                raise RenderError(
                    f"{words[0]} left no result: expected a JSON object or a number as its last line, result.json or "
                    "a picture in {out}"
                )
            return Outcome(values, files=files).beside(parameters)

    def _run(self, words: list[str]) -> subprocess.CompletedProcess[bytes]:
        try:
            return subprocess.run(
                words, cwd=self.folder, capture_output=True, timeout=self.limit_s, check=False, stdin=subprocess.DEVNULL
            )
        except subprocess.TimeoutExpired as error:
            raise RenderError(f"{words[0]} took longer than {self.limit_s:g} s") from error
        except OSError as error:
            text = f"{words[0]} cannot be started: {error}"
            is_missing = isinstance(error, FileNotFoundError | PermissionError) and Path(self.folder).is_dir()
            # other errors are those of a moment or of one point; a program that is swept may start at other points
            if not is_missing or "{" in self.words[0]:
                raise RenderError(text) from error
            raise MissingDependencyError(f"{text}; install the program, or name it with its path") from error

    def describe(self) -> list[str]:
        """Sentences for the plan of a run."""
        return [f"runs {self.words[0]} once per point, without a shell; nothing stays loaded between points"]


def _chosen(word: str, space: Space) -> list[str]:
    """The texts of a word with each value of the parameter that it names, if that chooses among values."""
    found = _PLACE.findall(word)
    if len(found) != 1 or found[0] not in space.names:
        return [word]
    return [word.replace(f"{{{found[0]}}}", _word(value)) for value in space[found[0]].choices] or [word]


def _content(folder: Path, word: str) -> str:
    """Hash of the file that a word names, also behind a sign of equality as in --config=FILE; "" if it names none."""
    for text in (word, word.partition("=")[2]):
        with suppress(OSError):  # such as code, which is longer than the name of a file
            file = folder / text
            if text and "{" not in text and file.is_file() and file.stat().st_size < 1e8:
                return hashlib.sha256(file.read_bytes()).hexdigest()
    return ""


def _failure(program: str, done: subprocess.CompletedProcess[bytes]) -> str:
    """The error of a program that failed: its last line first, as lists of failures show one line of each."""
    how = f"signal {-done.returncode}" if done.returncode < 0 else f"status {done.returncode}"
    said = done.stderr.decode("utf-8", "replace").strip()[-2000:]
    *earlier, last = said.splitlines() or [""]
    return "\n".join([f"{program} ended with {how}: {last.strip()}", *earlier]).rstrip()


@contextmanager
def _fresh_folder() -> Iterator[str]:
    made = temporary_folder("sweep-out-")  # a worker that is ended during a point leaves it to the next one
    try:
        yield str(made)
    finally:
        shutil.rmtree(made, ignore_errors=True)


def _word(value: Value) -> str:
    return repr(value) if isinstance(value, float) else str(value)


def _values(output: bytes, out: Path) -> dict[str, Any]:
    """Numbers and texts that the program gave."""
    found: Any = {}
    result = out / "result.json"
    lines = output[-1_000_000:].decode("utf-8", "replace").strip().splitlines()
    text = result.read_text("utf-8") if result.is_file() and not result.is_symlink() else lines[-1] if lines else ""
    try:
        found = json.loads(text) if text else {}
    except (ValueError, RecursionError) as error:
        if result.is_file():
            raise RenderError(f"the program's result.json is not JSON: {error}") from error
        found = {}
    if isinstance(found, int | float) and not isinstance(found, bool):
        found = {"result": found}
    if not isinstance(found, dict):
        return {}
    plain: dict[str, Any] = {}
    for name, value in found.items():
        join_values(plain, {f"{name}_{i}": item for i, item in enumerate(value)}
                    if isinstance(value, list) else {str(name): value})  # fmt: skip
    return {name: math.nan if value is None else value for name, value in plain.items()}
