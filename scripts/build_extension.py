# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the extension zip: blender_addon, spectral_core as a wheel, and every wheel it needs, for offline use.

``make extension`` writes dist/spectral_scene-VERSION.zip with wheels for the Pythons of Blender 4.3 to 5.2; Blender's
validator checks it. ``--python 3.11`` keeps one Python only: a smaller zip, for quick tests.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import importlib.util
import re
import shutil
import signal
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
STAGE, CACHE, DIST = ROOT / "build" / "extension", ROOT / "wheels", ROOT / "dist"
PYTHONS = ("3.11", "3.13", "3.14")
"""Blender 4.3 to 5.0 have 3.11, 5.1 and 5.2 have 3.13, Debian's 5.2 has 3.14."""
PLATFORM_TAGS = {
    "linux-x64": ["manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"],
    "windows-x64": ["win_amd64"],
    "macos-arm64": ["macosx_11_0_arm64", "macosx_12_0_arm64", "macosx_14_0_arm64"],
}
BUNDLED = [
    *("mitsuba", "drjit", "scipy", "daqp", "piqp", "threadpoolctl", "OpenEXR"),
    *("pynrrd", "nibabel", "tifffile", "mido", "python-osc"),
    *("importlib_resources", "typing_extensions", "packaging"),
    "colour-science",  # for the color rendering index of lamp recipes; without imageio, which is not used there
]
"""Never numpy: Blender has its own. What these need beyond numpy is listed here too."""


def run(*command: str, cwd: Path = ROOT) -> str:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"extension: {' '.join(command[:6])} … failed:\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done.stdout


def locked() -> list[str]:
    """Requirement of each bundled package with its hashes from requirements.lock, as tested."""
    text = (ROOT / "requirements.lock").read_text().replace("\\\n", " ")
    by_name = {line.split("==")[0].strip(): line for line in text.splitlines() if "==" in line}
    found = []
    for package in BUNDLED:
        pinned, *hashes = by_name[package.lower().replace("_", "-")].split("--hash")
        # without the marker, which is for the running Python, not for the one of the wheels
        found.append(" ".join([pinned.split(";")[0].strip(), *(f"--hash{each.strip()}" for each in hashes)]))
    return found


def download(platform: str, pythons: list[str]) -> list[Path]:
    """The bundled packages' wheels for one platform, kept in wheels/ between builds."""
    wanted = locked()
    found: list[Path] = []
    for python in pythons:
        folder = CACHE / platform / python
        stamp = folder / "complete"
        if not stamp.exists() or stamp.read_text() != "\n".join(wanted):
            shutil.rmtree(folder, ignore_errors=True)
            print(f"extension: fetching wheels for Python {python} on {platform}", flush=True)
            folder.mkdir(parents=True)
            listed = folder / "requirements.txt"
            listed.write_text("\n".join(wanted))
            tags = [part for tag in PLATFORM_TAGS[platform] for part in ("--platform", tag)]
            run(sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary", ":all:", "--dest",
                str(folder), "--python-version", python, *tags, "--require-hashes", "-r", str(listed),
                "--ignore-requires-python")  # fmt: skip  # colour-science is pure Python, and does not know 3.14 yet
            stamp.write_text("\n".join(wanted))
        found += folder.glob("*.whl")
    return list({path.name: path for path in found}.values())


def core_wheel() -> Path:
    """spectral_core alone as a wheel: the extension itself is the other half of the distribution.

    Its version ends in a hash of its files: Blender skips a wheel of an installed version, and would combine an
    older core with newer panels.
    """
    source = ROOT / "build" / "core"
    shutil.rmtree(source, ignore_errors=True)
    skip = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "spectral_core", source / "spectral_core", ignore=skip)
    for name in ("README.md", "LICENSE"):
        shutil.copy(ROOT / name, source / name)
    text = (ROOT / "pyproject.toml").read_text()
    text = text.replace('packages = ["spectral_core", "blender_addon"]', 'packages = ["spectral_core"]')
    digest = hashlib.sha256()
    for path in sorted((source / "spectral_core").rglob("*")):
        digest.update(path.read_bytes() if path.is_file() else b"")
    text = re.sub(r'^version = "(.+)"', rf'version = "\1+{digest.hexdigest()[:8]}"', text, count=1, flags=re.MULTILINE)
    text = re.sub(r"\[project\.scripts\]\n.*?\n\n", "", text, flags=re.DOTALL)
    (source / "pyproject.toml").write_text(text)
    run(sys.executable, "-m", "build", "--wheel", "--outdir", str(source / "dist"), cwd=source)
    return next((source / "dist").glob("*.whl"))


def isolated(wheel: Path) -> Path:
    """The wheel of OpenEXR with a module that calls its own functions; other wheels unchanged.

    A distribution's Blender shares its OpenEXR with the whole process: see ``spectral_core/files/elf.py``.
    """
    if not wheel.name.startswith("openexr-") or "linux" not in wheel.name:
        return wheel
    sys.path.insert(0, str(ROOT))
    from spectral_core.files.elf import made_to_call_itself

    version = wheel.name.split("-")[1]
    mark = f"{version}+isolated"  # Blender skips a wheel of a version that is installed
    made = ROOT / "build" / "isolated" / wheel.name.replace(version, mark, 1)
    made.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(wheel) as original:
        content = {
            name.replace(version, mark, 1): original.read(name) for name in original.namelist() if name[-1] != "/"
        }
    (module,) = (name for name in content if name.endswith(".so"))
    (record,) = (name for name in content if name.endswith(".dist-info/RECORD"))
    metadata = record.replace("RECORD", "METADATA")
    content[module] = made_to_call_itself(content[module])
    content[metadata] = content[metadata].replace(f"Version: {version}".encode(), f"Version: {mark}".encode(), 1)
    del content[record]
    lines = [f"{name},sha256={_digest(data)},{len(data)}" for name, data in content.items()]
    content[record] = "\n".join([*lines, f"{record},,", ""]).encode()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as changed:
        for name, data in content.items():
            changed.writestr(name, data)
    return made


def _digest(data: bytes) -> str:
    """SHA-256 in the form of a wheel's RECORD."""
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def stage(wheels: list[Path], platform: str) -> None:
    """The extension's folder in the layout for Blender's builder."""
    shutil.rmtree(STAGE, ignore_errors=True)
    shutil.copytree(ROOT / "blender_addon", STAGE, ignore=shutil.ignore_patterns("__pycache__", ".keep"))
    shutil.copy(ROOT / "LICENSE", STAGE / "LICENSE")
    (STAGE / "wheels").mkdir()
    for wheel in wheels:
        (STAGE / "wheels" / wheel.name).hardlink_to(wheel)
    manifest = STAGE / "blender_manifest.toml"
    listed = "".join(f'  "./wheels/{name}",\n' for name in sorted(wheel.name for wheel in wheels))
    filled = f'platforms = ["{platform}"]\nwheels = [\n{listed}]'
    manifest.write_text(manifest.read_text().replace("wheels = []", filled, 1))


BASE_LIBRARIES = (
    *("libc.so", "libm.so", "libdl.so", "libpthread.so", "librt.so", "ld-linux", "linux-vdso"),
    *("libgcc_s", "libstdc++"),
)
"""Libraries of every Linux that Blender runs on: another copy of these would cause crashes."""


def bundle_llvm(folder: Path) -> str:
    """Copy LLVM (17 or later) and its libraries into ``folder``, with their licenses; returns a summary."""
    sys.path.insert(0, str(ROOT))
    from spectral_core.llvm_library import find_llvm

    found = find_llvm()
    if found is None:
        return "no LLVM: none from 17 on is installed here (apt install libllvm19), so the artist must install one"
    library = Path(found[0]).resolve()
    needed = re.findall(r"^\s*(\S+) => (/\S+)", run("ldd", str(library)), re.MULTILINE)
    (folder / "licenses").mkdir(parents=True)
    for name, path in [(library.name, str(library)), *needed]:
        if name.startswith(BASE_LIBRARIES):
            continue
        shutil.copyfile(Path(path).resolve(), folder / name)
        license = _license(Path(path))
        if license is None:
            sys.exit(f"extension: the license of {path} was not found; the library cannot be included without it")
        shutil.copyfile(license[1], folder / "licenses" / f"{license[0]}.txt")
    size = sum(path.stat().st_size for path in folder.iterdir() if path.is_file()) / 1e6
    return f"LLVM {found[1]} from {library.name} with {len(list(folder.glob('*.so*'))) - 1} libraries, {size:.0f} MB"


def _license(library: Path) -> tuple[str, Path] | None:
    """Debian package of a library, and its statement of copyright and license."""
    for path in (library, library.resolve(), Path("/usr") / library.relative_to("/")):
        done = subprocess.run(["dpkg", "-S", str(path)], capture_output=True, text=True)
        if done.returncode == 0:
            package = done.stdout.split(":")[0]
            statement = Path("/usr/share/doc") / package / "copyright"
            return (package, statement) if statement.exists() else None
    return None


def blender_tool() -> list[str]:
    """Blender's own extension builder, as bpy ships it; pure Python, it needs no Blender running."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or spec.origin is None:
        sys.exit("extension: building needs bpy for Blender's own validator: pip install bpy (Python 3.11)")
    scripts = next(Path(spec.origin).parent.glob("*/scripts"))
    return [sys.executable, str(scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py")]


def tags_option() -> str:
    scripts = Path(blender_tool()[1]).parents[3]
    return f"--valid-tags={scripts / 'modules' / '_bpy_internal' / 'extensions' / 'tags.py'}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--python", action="append", choices=PYTHONS, help="only for this Python (may be repeated)")
    parser.add_argument("--platform", default="linux-x64", choices=PLATFORM_TAGS)
    parser.add_argument("--without-llvm", action="store_true", help="omit the LLVM library, for quick tests")
    parser.add_argument("--name", default="spectral_scene", help="start of the zip's name")
    given = parser.parse_args()
    wheels = [core_wheel(), *map(isolated, download(given.platform, given.python or list(PYTHONS)))]
    stage(wheels, given.platform)
    if given.platform == "linux-x64" and not given.without_llvm:
        print(f"extension: {bundle_llvm(STAGE / 'llvm')}")
    DIST.mkdir(exist_ok=True)
    version = tomllib.loads((ROOT / "blender_addon" / "blender_manifest.toml").read_text())["version"]
    package = DIST / f"{given.name}-{version}.zip"
    run(*blender_tool(), "build", tags_option(), "--source-dir", str(STAGE), "--output-filepath", str(package))
    run(*blender_tool(), "validate", tags_option(), str(package))
    print(f"extension: {package.relative_to(ROOT)} ({package.stat().st_size / 1e6:.0f} MB) passes Blender's validator")


if __name__ == "__main__":
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # a closed output ends the program without a message
    main()
