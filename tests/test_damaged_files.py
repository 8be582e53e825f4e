"""Files that are damaged, cut off or no files: one clear error, soon, whatever the format."""

import os
import random
import re
import warnings

import meshio
import numpy as np
import pytest
from marks import slow
from skfem import MeshTri

from skfem_dual import MeshError, MeshWarning
from skfem_dual.io import guarded, meshes, read_mesh
from skfem_dual.io.guarded import STEADY, read_through_meshio
from skfem_dual.messages import one_line

MESH = MeshTri().refined(2)
POINTS = np.column_stack([*MESH.p, np.zeros(MESH.p.shape[1])])
SOUND = meshio.Mesh(POINTS, {"triangle": MESH.t.T})
#: by suffix, the format and options of meshio's writer
FORMATS = {
    ".msh": ("gmsh", {}),
    ".vtk": ("vtk", {"binary": False}),
    ".vtu": ("vtu", {"binary": False}),
    ".xdmf": ("xdmf", {"data_format": "XML"}),
    ".off": ("off", {}),
    ".mesh": ("medit", {}),
    ".inp": ("abaqus", {}),
    ".ply": ("ply", {"binary": False}),
    ".stl": ("stl", {"binary": False}),
    ".obj": ("obj", {}),
}
APART = {".dat": "tecplot", ".wkt": "wkt", ".mdpa": "mdpa", ".bdf": "nastran", ".avs": "avsucd"}
SQUARE = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 {}\n"


@pytest.mark.parametrize(
    ("indices", "place"),
    [("2 -1", "[0, 2, -1] in triangle 1"), ("2 4", "[0, 2, 4] in triangle 1"), ("2 99999999", "")],
)
def test_nodes_that_the_file_does_not_have(tmp_path, indices, place):
    path = tmp_path / "plan.off"
    path.write_text(SQUARE.format(indices))
    with pytest.raises(MeshError, match=r"expected nodes from 0 to 3 in .*Remedy") as error:
        read_mesh(path)
    assert place in str(error.value)
    path.write_text(SQUARE.format("2 3"))
    assert read_mesh(path).t.shape == (3, 2)


@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".xdmf", ".mesh"])
@pytest.mark.parametrize("node", [-2, 25])
@pytest.mark.parametrize("kind", ["triangle", "line"])
def test_the_same_in_other_formats(tmp_path, suffix, node, kind):
    cells = {"triangle": MESH.t.T.copy(), "line": MESH.facets.T.copy()}
    cells[kind][7, 1] = node
    path = tmp_path / f"plan{suffix}"
    name, options = FORMATS[suffix]
    meshio.write(path, meshio.Mesh(POINTS, cells), name, **options)
    with pytest.raises(MeshError, match=f"got .*{node}.* in {kind} 7, the first of 1"):
        read_mesh(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": POINTS[:, :1]}, r"two or three coordinates .* shape \(25, 1\)"),
        ({"points": POINTS.astype(str)[:, :1] + "x"}, "expected numbers as coordinates"),
        ({"cells": {"triangle": MESH.t.T + 0.5}}, "expected 3 whole numbers .* float64"),
        ({"cells": {"triangle": MESH.facets.T}}, r"3 whole numbers .* shape \(56, 2\)"),
        ({"cell_sets": {"half": [[0, 32]]}}, "cells from 0 to 31 in the set 'half'"),
        ({"cell_sets": {"half": [[-1]]}}, "cells from 0 to 31 in the set 'half'"),
        ({"cell_sets": {"half": [[0.5]]}}, "cells from 0 to 31 in the set 'half'"),
        ({"cell_data": {"skfem:b:rim": [np.full((32, 2), "x")]}}, "tags .* cannot be read"),
        ({"cell_data": {"skfem:b": [np.zeros(32)]}}, "tags .* cannot be read"),
    ],
)
def test_what_a_reader_hands_over_is_checked(monkeypatch, change, message):
    parts = {"points": POINTS, "cells": {"triangle": MESH.t.T}} | change
    monkeypatch.setattr(meshes, "read_through_meshio", lambda path: meshio.Mesh(**parts))
    with pytest.raises(MeshError, match=message):
        read_mesh("plan.vtu")


def test_points_that_are_not_finite(tmp_path):
    p = np.vstack([POINTS, [[np.nan, 0, 0]]])
    path = tmp_path / "plan.vtu"
    meshio.write(path, meshio.Mesh(p, {"triangle": MESH.t.T}))
    with pytest.warns(MeshWarning, match="belong to no triangle: 25"):
        assert read_mesh(path).p.shape == (2, 25)
    p[3, 1] = np.inf
    meshio.write(path, meshio.Mesh(p, {"triangle": MESH.t.T}))
    with pytest.raises(MeshError, match=r"finite coordinates .* points 3"):
        read_mesh(path)


def test_groups_without_a_name(tmp_path):
    """Gmsh 2.2 with the area 1 named and the area 2 not."""
    path = tmp_path / "plan.msh"
    path.write_text(
        '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 "half"\n'
        "$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n"
        "$Elements\n3\n1 2 2 1 1 1 2 3\n2 2 2 2 2 1 3 4\n3 1 2 7 7 1 2\n$EndElements\n"
    )
    with pytest.warns(MeshWarning, match="without a name: 2 of areas, 7 of lines"):
        found = read_mesh(path)
    assert set(found.subdomains) == {"half"}
    assert found.subdomains["half"].tolist() == [0]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_what_is_no_regular_file(tmp_path):
    os.mkfifo(tmp_path / "pipe.msh")
    for path in (tmp_path / "pipe.msh", "/dev/zero", tmp_path, "", "a\0b"):
        with pytest.raises(ValueError, match=r"expected .* file, got"):
            read_mesh(path)
    with pytest.raises(TypeError, match="expected the path of a mesh file, got NoneType"):
        read_mesh(None)
    path = tmp_path / "plan.xdmf"
    meshio.write(path, SOUND)
    os.remove(tmp_path / "plan.h5")
    os.mkfifo(tmp_path / "plan.h5")
    with pytest.raises(MeshError, match=r"in a regular file, got 'plan\.h5'"):
        read_mesh(path)


@pytest.mark.parametrize("suffix", [".dat", *slow(*sorted({*APART} - {".dat"}))])
def test_sound_files_are_read_apart_alike(tmp_path, suffix):
    """Formats whose readers may not end."""
    assert STEADY.isdisjoint(APART.values())
    path = tmp_path / f"plan{suffix}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        meshio.write(path, SOUND, APART[suffix])
    found = read_mesh(path)
    order = np.lexsort(found.p)
    assert found.p[:, order] == pytest.approx(MESH.p[:, np.lexsort(MESH.p)], abs=1e-9)
    assert found.t.shape == MESH.t.shape


def test_node_numbers_which_look_like_counts_are_no_fault(tmp_path):
    path = tmp_path / "plan.mesh"
    meshio.write(path, SOUND, "medit")
    path.write_text(path.read_text() + "# 123456789\n")
    assert np.array_equal(read_mesh(path).t, MESH.t)


def test_headers_that_promise_more_than_the_file_holds(tmp_path):
    path = tmp_path / "grid.vtk"
    path.write_text(
        "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\n"
        "DIMENSIONS 20000 20000 1\nORIGIN 0 0 0\nSPACING 1 1 1\n"
    )
    with pytest.raises(MeshError, match="far more memory than the file is large"):
        read_mesh(path)
    path = tmp_path / "plan.off"
    for content in ("OFF\n", "OFF\n# only\n\n", "OFF"):
        path.write_text(content)
        with pytest.raises(MeshError, match="header of off is not complete"):
            read_mesh(path)
    path = tmp_path / "plan.ply"
    path.write_text("ply\nformat ascii 1.0\nelement vertex 4\n")
    with pytest.raises(MeshError, match="header of ply is not complete"):
        read_mesh(path)


ENDLESS = {
    ".dat": 'VARIABLES = "X", "Y"\nZONE NODES = 4, ELEMENTS = 2\n, DATAPACKING = POINT, '
    "ZONETYPE = FETRIANGLE\n0 0\n1 0\n",
    ".mdpa": "Begin Nodes\n 1 0 0 0\n",
    ".wkt": "TIN (" + "((0 0 0, 1 0 0, 1 1 0, 0 0 0)), " * 40 + "((0 0 0, 1 0",
}


@pytest.mark.parametrize(
    "suffix",
    [".dat", *slow(".mdpa", ".wkt")],
)
def test_readers_that_do_not_end(tmp_path, suffix, monkeypatch):
    monkeypatch.setattr(guarded, "CPU_SECONDS", 1.0)
    path = tmp_path / f"plan{suffix}"
    path.write_text(ENDLESS[suffix])
    with pytest.raises(MeshError, match="does not come to an end; the file is damaged"):
        read_mesh(path)


def damaged(content, dice):
    """Cut off, with other bytes, with another number, without a part, with a line moved."""
    content = bytearray(content)
    kind = dice.randrange(5)
    if kind == 0:
        return content[: dice.randrange(len(content))]
    if kind == 1:
        for _ in range(dice.randrange(1, 8)):
            content[dice.randrange(len(content))] = dice.randrange(256)
    if kind == 2:
        run = dice.choice([*re.finditer(rb"\d+", bytes(content))][:60])
        new = [b"0", b"-1", b"99999999999", b"4000", b"1e3", b"nan", b"9" * 23]
        content[run.start() : run.end()] = dice.choice(new)
    if kind == 3:
        start = dice.randrange(len(content))
        del content[start : start + dice.randrange(200)]
    if kind == 4:
        lines = bytes(content).split(b"\n")
        lines[dice.randrange(len(lines))] = dice.choice(lines)
        content = b"\n".join(lines)
    return content


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("rounds", [5, *slow(300)])
def test_damage_of_any_kind(tmp_path, suffix, rounds):
    """A mesh that can be used, or a MeshError in a few words, and always an end."""
    path = tmp_path / f"plan{suffix}"
    name, options = FORMATS[suffix]
    meshio.write(path, SOUND, name, **options)
    sound = path.read_bytes()
    for seed in range(rounds):
        path.write_bytes(damaged(sound, random.Random(f"{suffix} {seed}")))
        found, message = None, ""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                found = read_mesh(path)
            except MeshError as error:
                message = str(error)
        assert len(message) < 300 + len(str(path))
        assert "\n" not in message
        if found is not None:
            assert np.isfinite(found.p).all()
            assert (found.t >= 0).all()
            assert found.t.max() < found.p.shape[1]


def test_messages_are_cut_but_keep_the_remedy():
    text = "expected " + "many things, " * 100 + "got others. Remedy: mend them"
    found = one_line(text, 100)
    assert len(found) <= 100
    assert found.startswith("expected many things")
    assert found.endswith(" things, got others. Remedy: mend them")
    assert len(one_line("a" * 1000, 100)) <= 100
    assert len(one_line("Remedy: " * 1000, 100)) <= 100
    assert one_line("two\n lines", 100) == "two lines"


def test_unknown_formats_are_named(tmp_path):
    path = tmp_path / "plan.cad"
    path.write_text("x")
    with pytest.raises(MeshError, match="no format has such a name"):
        read_through_meshio(path)


def test_files_without_a_byte(tmp_path):
    empty = tmp_path / "plan.msh"
    empty.touch()
    with pytest.raises(MeshError, match=r"expected a mesh in .*plan.msh, which is empty"):
        read_mesh(empty)
