import numpy as np
import pytest
from skfem import ElementTriP0, MeshQuad, MeshTri, MeshTri1DG, MeshTri2
from skfem.mesh import Mesh2D

from skfem_dual import DualMesh, MeshError, check_mesh
from skfem_dual.grids.checks import crossing_parameters


def mesh(p, t, **tags):
    return MeshTri(np.array(p, dtype=float).T.copy(), np.array(t, dtype=np.int32).T.copy(), **tags)


SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]

FAULTY = {
    "nan": (mesh([(0, 0), (1, 0), (np.nan, 1)], [(0, 1, 2)]), "finite coordinates; 1 node.*: 2"),
    "infinite": (mesh([(0, 0), (np.inf, 0), (0, 1)], [(0, 1, 2)]), "finite coordinates"),
    "zero area": (
        mesh([(0, 0), (1, 0), (2, 0), (0, 1)], [(0, 1, 3), (0, 1, 2)]),
        "positive area; 1 triangle.*: 1",
    ),
    "nearly zero area": (
        mesh([(0, 0), (1, 0), (0.3, 1e-17)], [(0, 1, 2)]),
        "positive area; 1 triangle.*: 0",
    ),
    "vertex twice": (
        mesh(SQUARE, [(0, 1, 2), (0, 2, 3), (1, 1, 2)]),
        "three different vertices.*; 1 triangle.*: 2",
    ),
    "unused node": (mesh([*SQUARE, (5, 5)], [(0, 1, 2), (0, 2, 3)]), "every node.*; 1 node.*: 4"),
    "facet of three": (
        mesh([(0, 0), (1, 0), (0, 1), (0, -1), (1, 1)], [(0, 1, 2), (0, 1, 3), (0, 1, 4)]),
        "at most two triangles; 1 facet.*: 0 .*nodes 0 and 1",
    ),
    "fold": (
        mesh([(0, 0), (1, 0), (0.5, 1), (0.5, 0.5)], [(0, 1, 2), (0, 1, 3)]),
        "different sides.*; 1 facet.*nodes 0 and 1",
    ),
    "bow tie": (
        mesh([(0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)], [(0, 1, 2), (0, 3, 4)]),
        "one fan; 1 node.*: 0.*duplicate",
    ),
    "double turn": (
        mesh(
            [(0, 0), *[(np.cos(k * np.pi / 3), np.sin(k * np.pi / 3)) for k in range(12)]],
            [(0, 1 + k, 1 + (k + 1) % 12) for k in range(12)],
        ),
        "go round it once; 1 node.*: 0",
    ),
    "Fig. 3c": (
        mesh([(0, 0), (1, 0), (2.8, 1), (2.8, -1)], [(0, 1, 2), (0, 1, 3)]),
        "crossed by the segment.*; 1 facet.*nodes 0 and 1.*flip",
    ),
}


@pytest.mark.parametrize("name", FAULTY)
def test_faults_are_reported_and_refused(name):
    faulty, message = FAULTY[name]
    report = check_mesh(faulty)
    assert not report.ok
    assert not report.conditions[-1].ok
    assert "FAIL" in repr(report)
    with pytest.raises(MeshError, match=message):
        DualMesh.from_mesh(faulty)


def test_indices_out_of_range():
    # built past skfem, whose constructor already stumbles over some of these
    good = MeshTri()
    for bad, found in ((-1, "-1 to 3"), (7, "0 to 7")):
        t = good.t.copy()
        t[0 if bad < 0 else 2, 0] = bad
        broken = MeshTri(good.p, good.t)
        broken.t = t
        with pytest.raises(MeshError, match=rf"indices from 0 to 3; 1 triangle.*: 0.*{found}"):
            DualMesh.from_mesh(broken)


@pytest.mark.parametrize("name", ["doflocs", "t"])
def test_transposed_arrays(name):
    m = MeshTri().refined(2)
    setattr(m, name, getattr(m, name).T.copy())
    with pytest.raises(MeshError, match=r"shape \([23], n\).*transpose"):
        DualMesh.from_mesh(m)


def test_connectivity_of_floats():
    m = MeshTri()
    m.t = m.t.astype(float)
    with pytest.raises(MeshError, match="integer"):
        DualMesh.from_mesh(m)


@pytest.mark.parametrize("m", [MeshTri2(), MeshTri1DG()])
def test_curved_and_discontinuous_meshes_are_refused(m):
    with pytest.raises(MeshError, match=type(m).__name__):
        DualMesh.from_mesh(m)


@pytest.mark.parametrize("m", [MeshQuad(), None, np.eye(3), ElementTriP0()])
def test_other_things_are_refused(m):
    with pytest.raises(TypeError, match="expected a skfem MeshTri"):
        DualMesh.from_mesh(m)


def test_subclasses_are_welcome():
    class MyMesh(MeshTri):
        pass

    assert isinstance(MyMesh(), Mesh2D)
    assert len(DualMesh.from_mesh(MyMesh())) == 4


@pytest.mark.parametrize(
    ("tags", "message"),
    [
        ({"_boundaries": {"edge": np.array([0, 99])}}, "facet indices.*'edge'.*: 99"),
        ({"_boundaries": {"edge": np.array([0.5])}}, "integer facet indices in boundary 'edge'"),
        ({"_subdomains": {"plan": np.array([-1])}}, "triangle indices.*'plan'.*: -1"),
    ],
)
def test_bad_tags(tags, message):
    m = MeshTri()
    with pytest.raises(MeshError, match=message):
        DualMesh.from_mesh(MeshTri(m.p, m.t, **tags))


def test_curve_numbers_of_gmsh_are_no_tags():
    m = MeshTri()
    tagged = MeshTri(m.p, m.t, _subdomains={"gmsh:bounding_entities": np.array([-7])})
    assert check_mesh(tagged).ok
    assert DualMesh.from_mesh(tagged).mesh.subdomains is None


def test_crossings_agree_with_brute_force():
    """Random pairs of triangles: the rib crosses the facet iff both segments separate."""
    rng = np.random.default_rng(1)
    agreed = [0, 0]
    for _ in range(300):
        a, b = np.zeros(2), np.array([1.0, 0.0])
        c, d = rng.uniform(-1.5, 2.5, 2), rng.uniform(-1.5, 2.5, 2)
        c[1], d[1] = 0.05 + abs(c[1]), -0.05 - abs(d[1])
        pair = mesh([a, b, c, d], [(0, 1, 2), (0, 1, 3)])
        cl, cr = (a + b + c) / 3, (a + b + d) / 3
        x = cl[0] - cl[1] * (cr[0] - cl[0]) / (cr[1] - cl[1])
        crosses = 0 < x < 1
        assert check_mesh(pair).ok == crosses
        facet = np.nonzero(pair.f2t[1] != -1)[0]
        assert crossing_parameters(pair)[facet] == pytest.approx([x])
        agreed[int(crosses)] += 1
    assert min(agreed) > 20
