import errno
import os
import stat

import pytest
from skfem import MeshTri

from skfem_dual import DualMesh
from skfem_dual.io import require_outputs, write_dual, write_whole
from skfem_dual.report import write_data


def write(part):
    with open(part, "w") as file:
        file.write("new")


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt(), SystemExit(1)])
def test_nothing_is_left_of_a_failure(tmp_path, error):
    path = tmp_path / "result.txt"
    path.write_text("old")

    def fail(part):
        write(part)
        raise error

    with pytest.raises(type(error)):
        write_whole(path, fail)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_no_mapping_and_no_function(tmp_path):
    with pytest.raises(TypeError, match=r"expected a Mapping for outputs, got .*names of files"):
        require_outputs([tmp_path / "a.vtu"])
    with pytest.raises(TypeError, match="expected a function of a file name for write, got None"):
        write_whole(tmp_path / "a.txt", None)
    assert not list(tmp_path.iterdir())


def test_mode_and_symbolic_links_are_kept(tmp_path):
    path, link = tmp_path / "folder" / "result.txt", tmp_path / "link.txt"
    path.parent.mkdir()
    path.write_text("old")
    path.chmod(0o600)
    link.symlink_to(path)
    write_whole(link, write)
    assert link.is_symlink()
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert sorted(tmp_path.iterdir()) == [path.parent, link]
    assert list(path.parent.iterdir()) == [path]
    umask = os.umask(0o027)
    try:
        write_whole(tmp_path / "fresh.txt", write)
    finally:
        os.umask(umask)
    assert stat.S_IMODE((tmp_path / "fresh.txt").stat().st_mode) == 0o640


def test_write_protected_files_remain(tmp_path, monkeypatch):
    path = tmp_path / "result.txt"
    path.write_text("old")
    monkeypatch.setattr(os, "access", lambda target, mode: target != path)  # root may do all
    with pytest.raises(PermissionError, match=r"a file that may be written, got .*result\.txt"):
        write_whole(path, write)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    write_whole(tmp_path / "other.txt", write)


def test_errors_name_the_file_and_not_its_part(tmp_path):
    with pytest.raises(FileExistsError, match="got the folder"):
        write_whole(tmp_path, write)
    path = tmp_path / "none" / "result.txt"
    with pytest.raises(FileNotFoundError, match=r"no such folder for result\.txt: .*Remedy: make"):
        write_whole(path, write)
    long = tmp_path / ("long name " * 20 + ".txt")  # the name of its part is not longer
    write_whole(long, write)
    assert long.read_text() == "new"


def test_a_full_disk_is_told_with_the_file(tmp_path):
    """Of which errors in writing know nothing."""
    path = tmp_path / "a.json"

    def fail(part):
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space left on device") as error:
        write_whole(path, fail)
    assert (error.value.errno, error.value.filename) == (errno.ENOSPC, str(path))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("path", [None, 3, b"x.vtu", "a\0.vtu"])
def test_what_is_no_path(path):
    dual = DualMesh.from_mesh(MeshTri.init_circle(1))
    for write_to in (lambda: write_dual(path, dual), lambda: write_whole(path, write)):
        with pytest.raises((TypeError, ValueError), match=r"expected (a str|the path)"):
            write_to()


def test_outputs_are_not_inputs_nor_each_other(tmp_path):
    mesh = tmp_path / "plan.vtu"
    mesh.write_text("mesh")
    (tmp_path / "soft.vtu").symlink_to(mesh)
    os.link(mesh, tmp_path / "hard.json")
    (tmp_path / "dangling.png").symlink_to(tmp_path / "new.png")
    require_outputs({"--vtu": tmp_path / "new.vtu"}, {"MESH": mesh})
    for path in (
        mesh,
        os.path.relpath(mesh),
        tmp_path / "soft.vtu",
        tmp_path / "hard.json",
        tmp_path / ".." / tmp_path.name / "plan.vtu",
    ):
        with pytest.raises(ValueError, match="another file for --vtu than for MESH"):
            require_outputs({"--vtu": path}, {"MESH": mesh})
    with pytest.raises(ValueError, match="another file for --report than for --png"):
        require_outputs({"--png": tmp_path / "new.png", "--report": tmp_path / "dangling.png"})
    assert mesh.read_text() == "mesh"


def test_outputs_that_cannot_be_written(tmp_path):
    (tmp_path / "a.json").mkdir()
    with pytest.raises(FileExistsError, match=r"got the folder .*a\.json"):
        require_outputs({"--json": tmp_path / "a.json"})
    with pytest.raises(FileNotFoundError, match="no such folder for --json"):
        require_outputs({"--json": tmp_path / "none" / "a.json"})
    (tmp_path / "link.json").symlink_to(tmp_path / "nowhere" / "a.json")
    with pytest.raises(FileNotFoundError, match=r"no such folder for --json: .*nowhere"):
        require_outputs({"--json": tmp_path / "link.json"})
    os.mkfifo(tmp_path / "pipe.json")
    with pytest.raises(FileExistsError, match="got the pipe"):
        require_outputs({"--json": tmp_path / "pipe.json"})


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
def test_outputs_without_permission(tmp_path):
    path = tmp_path / "a.json"
    path.touch(0o444)
    with pytest.raises(PermissionError, match="may be written for --json"):
        require_outputs({"--json": path})
    path.unlink()
    tmp_path.chmod(0o555)
    with pytest.raises(PermissionError, match="cannot write to the folder of --json"):
        require_outputs({"--json": path})
    tmp_path.chmod(0o755)


def test_data_of_a_report_is_a_mapping(tmp_path):
    with pytest.raises(TypeError, match=r"a Mapping for data, .*Remedy: write_report of"):
        write_data(tmp_path / "data.json", [1.0])
    assert not list(tmp_path.iterdir())
