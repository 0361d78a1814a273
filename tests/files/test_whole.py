# SPDX-License-Identifier: GPL-3.0-or-later
"""A file is written whole or not at all, without leftovers."""

from __future__ import annotations

import os
import re
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from spectral_core.errors import FileWriteError, InvalidInputError
from spectral_core.files.whole import (
    make_folder,
    require_own_kind,
    require_writable,
    whole_file,
    write_bytes,
    write_text,
)

ROOT = Path(__file__).resolve().parents[2]


def test_a_file_is_written_whole_with_the_usual_permissions(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "größer")
    assert (tmp_path / "a.txt").read_text("utf-8") == "größer"
    mask = os.umask(0o022)
    os.umask(mask)
    assert stat.S_IMODE((tmp_path / "a.txt").stat().st_mode) == 0o666 & ~mask
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]


def test_permissions_of_the_earlier_file_are_kept(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    (tmp_path / "a.txt").chmod(0o640)
    write_text(tmp_path / "a.txt", "new")
    assert stat.S_IMODE((tmp_path / "a.txt").stat().st_mode) == 0o640


@pytest.mark.parametrize("failure", [ValueError("x"), KeyboardInterrupt(), OSError(28, "No space left on device")])
def test_a_failed_block_leaves_the_earlier_file(tmp_path: Path, failure: BaseException) -> None:
    (tmp_path / "a.txt").write_text("old")

    def fail() -> None:
        with whole_file(tmp_path / "a.txt") as unfinished:
            unfinished.write_text("ne")
            raise failure

    with pytest.raises(FileWriteError if isinstance(failure, OSError) else type(failure)) as caught:
        fail()
    assert (tmp_path / "a.txt").read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]
    if isinstance(failure, OSError):
        assert "No space left on device; the earlier file is unchanged" in str(caught.value)


def test_a_file_that_fails_its_check_does_not_replace_the_earlier_one(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")

    def refuse(path: Path) -> None:
        raise ValueError(f"{path.stat().st_size} bytes")

    with (
        pytest.raises(FileWriteError, match=r"is incomplete; is the disk full\? \(2 bytes\)"),
        whole_file(tmp_path / "a.txt", check=refuse) as unfinished,
    ):
        unfinished.write_text("ne")
    assert (tmp_path / "a.txt").read_text() == "old"


def test_an_absent_folder_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileWriteError, match=r"the folder .*nowhere does not exist; create it first"):
        write_bytes(tmp_path / "nowhere" / "a.txt", b"")
    with pytest.raises(InvalidInputError, match="is a folder"):
        write_bytes(tmp_path, b"")


@pytest.mark.skipif(os.name != "posix", reason="links and pipes as Unix has them")
def test_links_are_replaced_and_not_followed_and_devices_refused(tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("precious")
    (tmp_path / "link").symlink_to(tmp_path / "precious")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "precious").read_text() == "precious"
    assert not (tmp_path / "link").is_symlink()
    os.mkfifo(tmp_path / "pipe")
    for device in ("/dev/null", "/dev/stdout", tmp_path / "pipe"):
        if not os.path.lexists(device) or Path(device).is_file():
            continue
        with pytest.raises(InvalidInputError, match="device or a pipe"):
            write_text(device, "x")


@pytest.mark.skipif(os.name != "posix", reason="kill -9")
def test_leftovers_of_a_killed_writer_are_removed_and_files_of_a_running_one_kept(tmp_path: Path) -> None:
    code = (
        "import sys, time\nfrom spectral_core.files.whole import whole_file\n"
        f"with whole_file({str(tmp_path / 'a.txt')!r}) as unfinished:\n"
        "    unfinished.write_text('half')\n    print('writing', flush=True)\n    time.sleep(100)\n"
    )
    writer = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, cwd=ROOT)
    assert writer.stdout is not None
    writer.stdout.readline()
    write_text(tmp_path / "b.txt", "b")
    assert len(list(tmp_path.iterdir())) == 2  # the file of the running writer is unchanged
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    writer.stdout.close()
    # in another process, because this one has just searched the folder and limits the time of searches
    code = f"from spectral_core.files.whole import write_text; write_text({str(tmp_path / 'b.txt')!r}, 'b')"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
    assert [entry.name for entry in tmp_path.iterdir()] == ["b.txt"]


def test_a_path_from_a_document_replaces_only_files_of_the_same_type(tmp_path: Path) -> None:
    require_own_kind(tmp_path / "new", lambda path: False, "picture")
    (tmp_path / "old").write_text("x")
    require_own_kind(tmp_path / "old", lambda path: True, "picture")
    with pytest.raises(InvalidInputError, match="exists already and is no picture"):
        require_own_kind(tmp_path / "old", lambda path: False, "picture")


WRITES = re.compile(
    r"""open\([^)]*["'](?:w|a|x|r\+|wb|xb|ab|wt|rb\+)["']|\.write_(?:text|bytes)\(|savez|imsave|imwrite|np\.save\w*\("""
    r"""|savefig\(|\.tofile\(|\.write\(str\(|[a-z]\.write\(volume|image\.save\(|save_render\(|shutil\.(?:copy|move)"""
    r"""|os\.(?:replace|rename)\(|\.replace\(target|openvdb\.write|nrrd\.write"""
)
WITHIN_WHOLE = {
    "blender_addon/editing/dial/paths.py": 1,
    # calls that write to the new file of whole_file, by module
    "blender_addon/commands/render.py": 1,
    "blender_addon/editing/dial/picture_files.py": 1,
    "blender_addon/translate/shading/image_files/__init__.py": 1,  # a temporary file that is read at once
    "blender_addon/translate/display/transform.py": 1,  # a picture in a temporary folder that is read at once
    "spectral_core/cli/lattice.py": 2,
    "spectral_core/cli/shared/terminal.py": 1,  # the null device
    "spectral_core/explore/page/fonts.py": 1,
    "spectral_core/explore/sweep/files.py": 1,
    "spectral_core/explore/sweep/ledger/copied.py": 2,  # a private copy in a temporary folder, to read a closed one
    "spectral_core/explore/sweep/sweep.py": 1,  # a copy of a folder, to a temporary one
    "spectral_core/files/exr.py": 1,
    "spectral_core/files/whole.py": 4,
    "spectral_core/files/whole_set.py": 1,  # moves whole files
    "spectral_core/lattice/measure/plotting.py": 1,
    "spectral_core/render/cost/figure.py": 1,  # into the unfinished file of whole_file
    "spectral_core/spectra/pictures.py": 3,  # one of them into a temporary folder, read at once
    "spectral_core/volume/files/formats/nrrd_format.py": 1,
    "spectral_core/volume/files/formats/openvdb_format.py": 1,
    "spectral_core/volume/files/vdb/write.py": 1,
    "spectral_core/volume/files/write.py": 1,
}


def test_every_file_is_written_by_whole_file() -> None:
    """Every call that writes a file is in the reviewed list or uses whole_file."""
    found = {}
    for folder in ("spectral_core", "blender_addon", "examples"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            lines = [line for line in path.read_text("utf-8").splitlines() if WRITES.search(line)]
            if lines:
                found[path.relative_to(ROOT).as_posix()] = len(lines)
    assert found == WITHIN_WHOLE


def test_a_folder_that_cannot_be_made_is_named_with_the_file_in_its_way(tmp_path: Path) -> None:
    assert make_folder(tmp_path / "a" / "é b").is_dir() and make_folder(tmp_path / "a").is_dir()
    (tmp_path / "taken").write_text("")
    with pytest.raises(FileWriteError, match=r"below cannot be made: .*taken is a file; choose another folder"):
        make_folder(tmp_path / "taken" / "below")


def test_a_path_is_tried_before_long_work(tmp_path: Path) -> None:
    (tmp_path / "old.txt").write_text("old")
    require_writable(tmp_path / "old.txt")
    require_writable(tmp_path / "new" / "folder" / "a.txt")
    assert (tmp_path / "old.txt").read_text() == "old"
    assert list((tmp_path / "new" / "folder").iterdir()) == []
    with pytest.raises(FileWriteError, match=r"old.txt is a file; choose another folder"):
        require_writable(tmp_path / "old.txt" / "a.txt")
    with pytest.raises(InvalidInputError, match="is a folder"):
        require_writable(tmp_path / "new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new", "old.txt"]


def test_no_other_place_makes_folders_with_those_above_them() -> None:
    """Elsewhere a file in the way would end a command with the system's words alone."""
    found = [
        path.relative_to(ROOT)
        for folder in ("spectral_core", "blender_addon", "examples")
        for path in (ROOT / folder).rglob("*.py")
        if "mkdir(parents=True" in path.read_text("utf-8") or "makedirs(" in path.read_text("utf-8")
    ]
    assert found == [Path("spectral_core/files/whole.py")]
