# SPDX-License-Identifier: GPL-3.0-or-later
"""List installed parts, the LLVM and renderer variant in use, missing parts and how to get them."""

from __future__ import annotations

import argparse
import platform
import subprocess
import sys
from dataclasses import asdict, dataclass
from importlib import metadata, util

from spectral_core import __version__, child
from spectral_core.cli.shared.report import print_json
from spectral_core.cli.shared.trial import MARK
from spectral_core.errors import how_to_install


@dataclass(frozen=True)
class Finding:
    """One checked part: its presence, its version, and how to get it if it is missing."""

    name: str
    ok: bool
    found: str
    needed_for: str
    remedy: str = ""
    essential: bool = False


# import name, distribution, features that need it, extra that installs it ("": the package cannot do without)
PACKAGES = [
    ("numpy", "numpy", "everything", ""),
    ("scipy", "scipy", "everything", ""),
    ("daqp", "daqp", "palettes", ""),
    ("piqp", "piqp", "palettes", ""),
    ("threadpoolctl", "threadpoolctl", "palettes", ""),
    ("mitsuba", "mitsuba", "rendering", "render"),
    ("drjit", "drjit", "rendering", "render"),
    ("OpenEXR", "OpenEXR", "spectral EXR files", "render"),
    ("bpy", "bpy", ".blend files outside Blender, the demo", "blender"),
    ("cvxpy", "cvxpy", "comparing palettes with general solvers; no command needs it", "general"),
    ("colour", "colour-science", "color rendering of lamp recipes", "catalogue"),
    ("nrrd", "pynrrd", "NRRD volumes", "volumes"),
    ("nibabel", "nibabel", "NIfTI volumes", "volumes"),
    ("tifffile", "tifffile", "TIFF stacks", "volumes"),
    ("mido", "mido", "MIDI faders", "board"),
    ("rtmidi", "python-rtmidi", "MIDI faders", "board"),
    ("pythonosc", "python-osc", "OSC faders", "board"),
    ("matplotlib", "matplotlib", "figures", "figures"),
    ("PIL", "pillow", "thumbnails and distances of pictures in sweeps", "explore"),
    ("flip_evaluator", "flip-evaluator", "FLIP in sweeps", "explore"),
    ("distributed", "distributed", "sweeps on a dask cluster", "dask"),
    ("pyoidn", "pyoidn", "denoising (88 MB)", "denoise"),
]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--strict", action="store_true", help="exit status 1 where anything optional is missing, too")


def run(arguments: argparse.Namespace) -> int:
    findings = [_python(), *(_package(*entry) for entry in PACKAGES), *_renderer(), *_blender_loads()]
    for finding in findings:
        mark = "ok     " if finding.ok else "MISSING"
        print(f"{mark}  {finding.name:16} {finding.found}")
        if not finding.ok:
            print(f"         needed for {finding.needed_for}; {finding.remedy}")
    essential = all(finding.ok for finding in findings if finding.essential)
    complete = all(finding.ok for finding in findings)
    if arguments.json:
        found = [asdict(finding) for finding in findings]
        print_json({"version": __version__, "ok": essential, "complete": complete, "findings": found})
    return 0 if (complete if arguments.strict else essential) else 1


def _python() -> Finding:
    note = (
        "" if sys.version_info[:2] == (3, 11) else " (bpy from PyPI exists for 3.11 only; inside Blender this is fine)"
    )
    return Finding("Python", sys.version_info >= (3, 11), platform.python_version() + note, "everything",
                   "install Python 3.11", essential=True)  # fmt: skip


def _package(module: str, distribution: str, needed_for: str, extra: str) -> Finding:
    if util.find_spec(module) is None:
        remedy = how_to_install(distribution, extra)
        return Finding(distribution, False, "not installed", needed_for, remedy, essential=not extra)
    try:
        version = metadata.version(distribution)
    except metadata.PackageNotFoundError:
        version = "there, version unknown"
    return Finding(distribution, True, version, needed_for, essential=not extra)


def _renderer() -> list[Finding]:
    """LLVM and the variant that a render would use, tried in a separate process."""
    if util.find_spec("mitsuba") is None:
        return []
    from spectral_core.llvm_library import llvm_remedy
    from spectral_core.render import variant

    backend = variant.describe_backend()
    library = backend["llvm_library"]
    version = f" (version {backend['llvm_version']})" if library else ""
    findings = [
        Finding("LLVM", library is not None, f"{library or 'none that can be used'}{version}", "rendering",
                llvm_remedy()),
    ]  # fmt: skip
    done, _ = _trial("render")
    found, remedy = ", ".join(backend.get("variant", {}).values()), "install LLVM as stated above"
    if library is not None and done.returncode:
        found = ": ".join(filter(None, [found, f"a trial render failed, {_last_line(done)}"]))
        remedy = "see the error in this line; Debian, Ubuntu: apt install libatomic1 libllvm19"
    elif done.returncode:
        found = "it cannot start without LLVM"
    findings.append(Finding("renderer", done.returncode == 0, found, "rendering", remedy))
    return findings


def _blender_loads() -> list[Finding]:
    """Check that an installed bpy also starts: it links to X libraries that a server may lack."""
    if util.find_spec("bpy") is None:
        return []
    done, version = _trial("bpy")
    if done.returncode == 0:
        return [Finding("bpy starts", True, f"Blender {version}", ".blend files outside Blender")]
    remedy = "apt install libx11-6 libxrender1 libxfixes3 libxi6 libxxf86vm1 libxkbcommon0 libsm6 libgl1 libegl1"
    return [Finding("bpy starts", False, _last_line(done), ".blend files outside Blender", remedy)]


def _trial(what: str) -> tuple[subprocess.CompletedProcess[str], str]:
    """Run a trial in a separate process, and find its answer in the output."""
    line = child.command(sys.executable, "spectral_core.cli.shared.trial", what)
    done = subprocess.run(line, capture_output=True, text=True, errors="replace", env=child.environment())
    answers = [line.removeprefix(MARK) for line in done.stdout.splitlines() if line.startswith(MARK)]
    return done, (answers or [""])[-1]


def _last_line(done: subprocess.CompletedProcess[str]) -> str:
    return (done.stderr.strip() or "it ended without a message").splitlines()[-1]
