# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets this checkout up: system libraries, .venv, packages. Safe to run twice; the second time it only checks.

Imports the standard library only: nothing is installed yet. With root or sudo the few system libraries that bpy and
drjit need come from the distribution; without, the one command to run is printed. Without LLVM everything except
rendering works.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python"
STAMP, UNFINISHED = VENV / ".set-up", VENV / ".unfinished"
LOCK = "requirements.lock"
OLDEST_LLVM = 17  # 15 and 16 abort in drjit's code generation: "Cannot select: fminimum"
NEWEST_LLVM = 20  # of those that were tried

# library that bpy or drjit links to -> Debian and Ubuntu package that holds it
LINKED_LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libXrender.so.1": "libxrender1",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXxf86vm.so.1": "libxxf86vm1",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libatomic.so.1": "libatomic1",
}


def say(text: str) -> None:
    try:
        print(f"setup: {text}", flush=True)
    except BrokenPipeError:  # as after `make setup | head -1`: nobody reads on, and the set-up is still finished
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def has_llvm() -> bool:
    """True if drjit's loader finds an LLVM that it can use."""
    if os.environ.get("DRJIT_LIBLLVM_PATH"):
        return True
    folders = [Path("/usr/lib"), Path("/usr/lib64"), Path("/usr/local/lib"), *Path("/usr/lib").glob("*-linux-gnu")]
    names = [path.name for folder in folders if folder.is_dir() for path in folder.glob("libLLVM*.so*")]
    versions = [int(found[1]) for name in names if (found := re.search(r"(?:LLVM-|\.so\.)(\d+)", name))]
    return any(version >= OLDEST_LLVM for version in versions)


def privileged() -> list[str] | None:
    """Prefix of a command that needs root: nothing, sudo, or None if neither is available."""
    if os.geteuid() == 0:
        return []
    if shutil.which("sudo") and subprocess.run(["sudo", "-n", "true"], capture_output=True).returncode == 0:
        return ["sudo", "-n"]
    return None


def newest_llvm_package() -> str:
    """The newest libllvm of this distribution that drjit can use, "" if there is none; Debian 12's is libllvm19."""
    listed = subprocess.run(["apt-cache", "pkgnames", "libllvm"], capture_output=True, text=True).stdout
    versions = [int(found[1]) for found in re.finditer(r"^libllvm(\d+)(?:t64)?$", listed, re.MULTILINE)]
    known_good = [version for version in versions if OLDEST_LLVM <= version <= NEWEST_LLVM]
    return f"libllvm{max(known_good)}" if known_good else ""


def system_libraries() -> None:
    missing = sorted({package for library, package in LINKED_LIBRARIES.items() if not loads(library)})
    llvm_missing = not has_llvm()
    if not missing and not llvm_missing:
        return
    if not shutil.which("apt-get"):
        needed = ", ".join([*missing, *([f"LLVM {OLDEST_LLVM} or newer (libLLVM.so)"] if llvm_missing else [])])
        say(f"there is no apt-get here; install these yourself: {needed}")
        if missing:
            sys.exit(1)
        return
    before = privileged()
    if before is None:
        packages = [*missing, *([newest_llvm_package() or "libllvm19"] if llvm_missing else [])]
        say(
            f"some system libraries are missing and there is neither root nor sudo here. Run once:\n\n"
            f"    su -c 'apt-get update && apt-get install -y --no-install-recommends {' '.join(packages)}'\n"
        )
        if missing:
            sys.exit(1)
        say("only LLVM is missing: set-up continues without it, but rendering needs it")
        return
    environment = dict(os.environ, DEBIAN_FRONTEND="noninteractive")
    say("reading the distribution's package lists")
    if subprocess.run([*before, "apt-get", "update", "-qq"], env=environment).returncode:
        say("apt-get update failed; its words are above. Is there a network?")
        sys.exit(1)
    llvm = newest_llvm_package() if llvm_missing else ""
    if llvm_missing and not llvm:  # as on Ubuntu 22.04, whose newest is 15
        say(
            f"this distribution offers no LLVM from {OLDEST_LLVM} to {NEWEST_LLVM}: set-up continues without it, but "
            "rendering needs it; see https://apt.llvm.org"
        )
    packages = [*missing, *([llvm] if llvm else [])]
    if not packages:
        return
    say(f"installing {' '.join(packages)}")
    quiet = ["apt-get", "install", "-y", "-qq", "--no-install-recommends"]
    done = subprocess.run([*before, *quiet, *packages], env=environment, capture_output=True, text=True)
    if done.returncode:
        print(done.stdout[-2000:], done.stderr[-2000:], file=sys.stderr)
        say("the distribution's package manager failed; its output is above")
        sys.exit(1)


def wanted() -> str:
    """Fingerprint of the packages to install and of the Python version."""
    parts = [(ROOT / name).read_bytes() for name in ("pyproject.toml", LOCK)]
    return hashlib.sha256(b"\0".join([*parts, sys.version.encode(), str(VENV).encode()])).hexdigest()


def whats_wrong() -> str:
    """Why .venv cannot be used as it is; "" if it can, or where there is none."""
    if not os.path.lexists(VENV):
        return ""
    if UNFINISHED.exists():
        return "its set-up was interrupted"
    # pip last: the Python of a bare system has none, and the origin of that Python is the more useful message.
    code = "import sys; print(sys.version); print(sys.prefix, flush=True); import pip"
    try:
        done = subprocess.run([str(PYTHON), "-I", "-c", code], capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"its Python does not start ({error})"
    broken = f"its Python or pip is broken ({(done.stderr.strip() or 'no message').splitlines()[-1]})"
    if done.returncode and len(done.stdout.splitlines()) < 2:
        return broken
    *version, prefix = done.stdout.strip().splitlines()
    if " ".join(version).split()[0] != sys.version.split()[0]:
        return f"it is of Python {' '.join(version).split()[0]}, this is {sys.version.split()[0]}"
    if Path(prefix).resolve() != VENV.resolve():
        return f"it belongs to {prefix}"
    return broken if done.returncode else moved()


def moved() -> str:
    """Why the programs of .venv, such as lint-imports, start nothing: they name the folder in which it was made."""
    stated = re.search(
        r"^command = .* -m venv (?:--\S+ )*(.*)$", (VENV / "pyvenv.cfg").read_text("utf-8"), re.MULTILINE
    )
    return f"it was made as {stated[1]}" if stated and stated[1] != str(VENV) else ""


def packages() -> None:
    """Create .venv from the lock file, from scratch if the existing one cannot be trusted."""
    discarded = VENV.with_name(".venv-discarded")
    shutil.rmtree(discarded, ignore_errors=True)
    wrong = whats_wrong()
    if not wrong and STAMP.exists() and STAMP.read_text() == wanted():
        return
    if wrong:
        say(f".venv is created again: {wrong}")
        if VENV.is_symlink() or VENV.is_file():
            VENV.unlink()
        else:
            # Moved first: an interrupted removal leaves a folder whose mark may be missing and whose packages lack
            # files, and pip treats those as installed.
            VENV.rename(discarded)
            shutil.rmtree(discarded)
    if not VENV.exists():
        say(f"making .venv with Python {sys.version.split()[0]}")
        VENV.mkdir()
        UNFINISHED.touch()
        try:
            venv.create(VENV, with_pip=True)
        except subprocess.CalledProcessError:
            package = (
                f"python{sys.version_info.major}.{sys.version_info.minor}-venv"  # python3-venv is of another Python
            )
            say(f"Python's own pip cannot be installed; on Debian and Ubuntu: apt install {package}")
            sys.exit(1)
    UNFINISHED.touch()
    STAMP.unlink(missing_ok=True)
    say("installing the packages (bpy and Mitsuba are large: a minute or two)")
    pip = [str(PYTHON), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    # Each file is compared with its hash; this checkout itself is built with what was just installed.
    install(*pip, "--require-hashes", "--requirement", LOCK)
    install(*pip, "--no-deps", "--no-build-isolation", "--editable", ".")
    STAMP.write_text(wanted())
    UNFINISHED.unlink()


def require_folder(root: str) -> None:
    """End where Blender's color management would take a part of the path as a variable: its pictures are too dark."""
    if "$" in root or root.count("%") > 1:
        say(f"Blender cannot work in {root}: it takes '$' and '%…%' in a path as variables; move this checkout")
        sys.exit(1)


def install(*command: str) -> None:
    if subprocess.run(command, cwd=ROOT).returncode:
        say("pip failed; its words are above. Is there a network, and is this Python 3.11?")
        sys.exit(1)


def main() -> None:
    if sys.version_info < (3, 11):
        say(f"this is Python {sys.version.split()[0]}; Python 3.11 is needed (Debian 12: python3 python3-venv)")
        sys.exit(1)
    if sys.version_info[:2] != (3, 11):
        say(
            f"this is Python {sys.version.split()[0]}: bpy exists for 3.11 only, so parts that need Blender, such as "
            "the demo, are omitted. For these install Python 3.11 (Ubuntu: python3.11-venv of ppa:deadsnakes/ppa), and "
            "run this again"
        )
    require_folder(str(ROOT))
    system_libraries()
    packages()
    say("ready")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        say("stopped; run it again to finish")
        sys.exit(130)
