"""Symmetry of plans: what is found, and that nothing but the effort changes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow
from plans import annulus, disc, perturbed, polar, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshQuad, MeshTri

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, RigidPunch
from skfem_dual.contact.unilateral import ContactProblem, active_set, conjugate_gradients
from skfem_dual.errors import MeshError
from skfem_dual.grids.partition import Partition
from skfem_dual.operators.symmetric_matrix import SymmetricMatrix
from skfem_dual.operators.symmetry import Symmetry

SOIL = HalfSpace(1.0, 0.25)


def dual(mesh):
    return DualMesh.from_mesh(mesh).basis()


def triangles(mesh):
    return CellBasis(mesh, ElementTriP0())


def turned(mesh, angle, shift=(0.0, 0.0)):
    c, s = np.cos(angle), np.sin(angle)
    return MeshTri(np.array([[c, -s], [s, c]]) @ mesh.p + np.array(shift)[:, None], mesh.t)


def reflected(mesh, about=(-1.0, 1.0)):
    """The mesh and its image; it must reach the mirror line."""
    return mesh + mesh.scaled(about)


def half():
    """An irregular half and its image in the y axis."""
    quarter = MeshTri.init_tensor(np.linspace(0, 2, 6), np.linspace(-1, 1, 6))
    return reflected(perturbed(quarter, 0.05))


def quarters():
    """An irregular quarter and its images in both axes."""
    quarter = MeshTri.init_tensor(np.linspace(0, 2, 6), np.linspace(0, 1, 4))
    return reflected(reflected(perturbed(quarter, 0.05)), (1.0, -1.0))


def hexagon():
    angle = np.pi / 3 * np.arange(6)
    p = np.hstack([np.zeros((2, 1)), [np.cos(angle), np.sin(angle)]])
    k = np.arange(6)
    return MeshTri(p, np.stack([0 * k, 1 + k, 1 + (k + 1) % 6])).refined(3)


def twisted(mesh):
    """Turned the more the farther from the middle: rotations stay, mirror lines do not."""
    angle = np.arctan2(mesh.p[1], mesh.p[0]) + 0.5 * np.sum(mesh.p**2, axis=0)
    return MeshTri(np.hypot(*mesh.p) * [np.cos(angle), np.sin(angle)], mesh.t)


PLANS = {
    "disc": (dual(disc(3)), "C4v"),
    "triangles of a disc": (triangles(disc(3)), "C4v"),
    "graded disc": (dual(disc(3, graded=True)), "C4v"),
    "square": (dual(MeshTri.init_symmetric().refined(3)), "C4v"),
    "square, cut along one diagonal": (dual(rectangle(8)), "C2v"),
    "rectangle, cut along one diagonal": (triangles(rectangle(8, 1, 0.5)), "C2"),
    "rectangles": (
        CellBasis(
            MeshQuad.init_tensor(np.linspace(0, 3, 7), np.linspace(0, 1, 4)), ElementQuad0()
        ),
        "C2v",
    ),
    "L": (dual(MeshTri.init_lshaped().refined(2)), "Cs"),
    "halves": (dual(half()), "Cs"),
    "quarters": (triangles(quarters()), "C2v"),
    "hexagon": (dual(hexagon()), "C6v"),
    "annulus": (dual(annulus(4, 12)), "C12v"),
    "triangles of an annulus": (triangles(annulus(3, 15)), "C15v"),
    "polar": (CellBasis(polar(5, 10), ElementQuad0()), "C10v"),
    "twisted hexagon": (dual(twisted(hexagon())), "C6"),
    "twisted annulus": (triangles(twisted(annulus(3, 9))), "C9"),
    "far and turned": (dual(turned(hexagon(), 0.3, (1000.0, -500.0))), "C6v"),
    "none": (dual(perturbed(rectangle(8), 0.02)), "C1"),
}


def symmetric(punch):
    """Symmetry of a punch and its matrix from the rows of the representatives."""
    x = punch.collocation_points
    asked = []

    def rows(i):
        asked.extend(i)
        return punch.influence(x[:, i].copy())

    symmetry = Symmetry.detect(punch.partition, x, punch.weights)
    matrix = SymmetricMatrix.from_rows(symmetry, rows)
    assert asked == symmetry.representatives.tolist()
    return symmetry, matrix


@pytest.mark.parametrize("edge", ["singular", "constant"])
@pytest.mark.parametrize("plan", PLANS)
def test_blocks_equal_the_full_matrix(plan, edge):
    basis, name = PLANS[plan]
    punch = RigidPunch(SOIL, basis, edge=edge)
    symmetry, matrix = symmetric(punch)
    assert symmetry.name == name
    D = punch.matrix
    # rounding of the coordinates over the size of the cells; polynomials that stand for the law of
    # the edge magnify it by powers of the distance over the width of a cell: where they are thin
    tol = 1e-10 if plan == "far and turned" else 1e-12
    if edge == "singular":
        tol = 1e-8 if plan in ("graded disc", "twisted annulus", "far and turned") else 2e-10
    size = np.abs(D).max()
    for permutation in symmetry.permutations:
        assert np.abs(D[np.ix_(permutation, permutation)] - D).max() < tol * size
    assert matrix.shape == D.shape
    assert np.abs(np.asarray(matrix) - D).max() < tol * size
    q = np.random.default_rng(0).standard_normal((len(D), 3))
    for trans, full in enumerate((D, D.T)):
        expected = np.linalg.solve(full, q)
        found = matrix.factors.solve(q, trans)
        assert np.abs(found - expected).max() < tol * np.abs(expected).max()
    assert matrix @ q == pytest.approx(D @ q, abs=tol * np.abs(D @ q).max())
    assert matrix @ q[:, 0] == pytest.approx((matrix @ q)[:, 0], rel=1e-9, abs=1e-13)
    assert matrix.condition_number == pytest.approx(np.linalg.cond(D), rel=max(tol, 1e-8))


@pytest.mark.parametrize("plan", PLANS)
def test_bases_are_orthonormal_and_complete(plan):
    partition = Partition.from_basis(PLANS[plan][0])
    symmetry = Symmetry.detect(partition)
    n = len(partition)
    vectors = [
        v
        for part in symmetry.components
        for basis in part.bases
        for v in ([basis, basis.conj()] if part.twice else [basis])
    ]
    V = np.hstack([v.toarray() for v in vectors])
    assert V.shape == (n, n)
    assert np.abs(V.conj().T @ V - np.eye(n)).max() < 1e-13


@pytest.mark.parametrize("plan", PLANS)
def test_permutations_are_a_group(plan):
    symmetry = Symmetry.detect(Partition.from_basis(PLANS[plan][0]))
    elements = {tuple(p) for p in symmetry.permutations}
    assert symmetry.permutations[0].tolist() == list(range(len(symmetry)))
    assert len(elements) == len(symmetry.permutations)
    generators = symmetry.permutations[[min(1, len(elements) - 1), -1]]
    assert all(tuple(np.array(p)[g]) in elements for p in elements for g in generators)


def test_motions_take_cells_to_their_images():
    """The permutations are those that rotations and mirror line say."""
    partition = Partition.from_basis(dual(hexagon()))
    symmetry = Symmetry.detect(partition)
    z = partition.centroids[0] + 1j * partition.centroids[1]
    for k in range(6):
        turn = np.exp(2j * np.pi * k / 6)
        assert np.abs(z[symmetry.permutations[k]] - turn * z).max() < 1e-14
        mirrored = np.exp(2j * symmetry.mirror) * z.conj()
        assert np.abs(z[symmetry.permutations[6 + k]] - turn * mirrored).max() < 1e-14


@settings(max_examples=40)
@given(st.floats(0, 2 * np.pi), st.floats(-1e3, 1e3), st.floats(0.01, 100))
def test_detection_does_not_depend_on_the_position(angle, shift, scale):
    mesh = turned(half(), angle, (shift, -2 * shift)).scaled(scale)
    symmetry = Symmetry.detect(Partition.from_basis(dual(mesh)))
    assert symmetry.name == "Cs"
    assert np.sin(symmetry.mirror - angle - np.pi / 2) == pytest.approx(0, abs=1e-7)


def test_detection_does_not_depend_on_the_numbering():
    mesh = disc(3)
    rng = np.random.default_rng(0)
    order = rng.permutation(mesh.nvertices)
    p = np.empty_like(mesh.p)
    p[:, order] = mesh.p
    mixed = MeshTri(p, order[mesh.t][:, rng.permutation(mesh.nelements)])
    partition = Partition.from_basis(dual(mixed))
    assert Symmetry.detect(partition).name == "C4v"


@pytest.mark.parametrize("size", [1e-3, 1e-6, 1e-8])
def test_perturbed_nodes_are_noticed(size):
    partition = Partition.from_basis(dual(perturbed(MeshTri.init_symmetric().refined(3), size)))
    assert Symmetry.detect(partition).name == "C1"


def test_a_single_node_is_noticed():
    mesh = MeshTri.init_symmetric().refined(3)
    p = mesh.p.copy()
    node = mesh.interior_nodes()[5]
    p[:, node] += 1e-7
    assert Symmetry.detect(Partition.from_basis(dual(MeshTri(p, mesh.t)))).name in ("C1", "Cs")


def test_rounded_coordinates_by_a_tolerance():
    mesh = MeshTri(hexagon().p.round(7), hexagon().t)
    partition = Partition.from_basis(dual(mesh))
    assert Symmetry.detect(partition).name in ("C2v", "C2", "Cs", "C1")
    assert Symmetry.detect(partition, tol=1e-6).name == "C6v"


def test_edge_and_collocation_points_count():
    mesh = MeshTri.init_symmetric().refined(3)
    left = mesh.with_boundaries({"left": lambda x: x[0] == 0, "sides": lambda x: x[0] % 1 == 0})
    for boundary, name in (("left", "Cs"), ("sides", "C2v")):
        punch = RigidPunch(SOIL, dual(left), edge_boundaries=boundary)
        assert Symmetry.detect(punch.partition).name == "C4v"
        assert symmetric(punch)[0].name == name
    partition = Partition.from_basis(dual(mesh))
    x = partition.nodes.copy()
    assert Symmetry.detect(partition, x).name == "C4v"
    x[:, 40] += [1e-3, 2e-3]
    assert Symmetry.detect(partition, x).name == "C1"


@pytest.mark.parametrize(
    ("substrate", "collocation"),
    [(SOIL, "node"), (GradedHalfSpace.init_linear(1.0, 0.25, 1.0), "centroid")],
    ids=["nodes", "graded ground"],
)
def test_other_grounds_and_points(substrate, collocation):
    edge = "constant" if collocation == "node" else "singular"
    punch = RigidPunch(substrate, dual(disc(2)), edge=edge, collocation=collocation)
    symmetry, matrix = symmetric(punch)
    assert symmetry.name == "C4v"
    rhs = punch.planes(punch.collocation_points).T
    expected = np.linalg.solve(punch.matrix, rhs)
    # rules of the remainder meet at distances that differ by rounding between mirrored cells
    rounding = 1e-12 if substrate.remainder is None else 1e-8
    assert np.abs(matrix.factors.solve(rhs) - expected).max() < rounding * np.abs(expected).max()


def test_stiffness_of_the_punch():
    punch = RigidPunch(SOIL, dual(quarters()))
    _, matrix = symmetric(punch)
    found = punch.resultants @ matrix.factors.solve(punch.planes(punch.collocation_points).T)
    assert found == pytest.approx(punch.system.stiffness, abs=1e-11)


def test_contact_that_is_found():
    """An eccentric load has not the symmetry of the plan; the matrix has."""
    punch = RigidPunch(SOIL, dual(disc(3)))
    symmetry, matrix = symmetric(punch)
    x = punch.collocation_points
    rest = punch.partition.areas, np.zeros(len(symmetry)), punch.planes(x), punch.resultants
    given = np.array([1.0, 0.4, 0.2])
    expected = active_set(ContactProblem(punch.matrix, *rest, given), np.ones(len(symmetry), bool))
    assert not expected.touching.all()
    problem = ContactProblem(matrix, *rest, given)
    for found in (active_set(problem, np.ones(len(symmetry), bool)), conjugate_gradients(problem)):
        assert found.success
        assert found.pressure == pytest.approx(expected.pressure, abs=1e-8)


@pytest.mark.parametrize("grid", ["dual", *slow("triangles")])
@pytest.mark.parametrize("length", [2.0, *slow(3.0)])
def test_turned_rectangles_of_equal_triangles(grid, length):
    """Distances and laws that are the same in many places decide nothing by their rounding."""
    mesh = MeshTri.init_symmetric().refined(3)
    mesh = MeshTri(mesh.p * np.array([[length], [1.0]]), mesh.t)
    found, matrices = [], []
    for angle in (0.0, 0.3, 1.219, 2.0):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        turned = DualMesh.from_mesh(MeshTri(turn @ mesh.p, mesh.t))
        basis = turned.basis() if grid == "dual" else turned.primal_basis()
        middle, at = turn @ [length / 2, 0.5], turn @ [0.375 * length, 0.1]
        for symmetry in (None, "auto"):
            punch = RigidPunch(SOIL, basis, origin=middle, symmetry=symmetry)
            solution = punch.solve(1.0, at=at)
            assert solution.success
            assert (solution.gap > 0).any()
            found.append((solution.settlement, *(turn.T @ solution.tilt)))
            if symmetry is None:
                matrices.append(punch.matrix)
    least = 1e-7 * matrices[0].max()
    assert all(np.allclose(each, matrices[0], 1e-7, least) for each in matrices)
    assert np.array(found) == pytest.approx(np.tile(found[0], (8, 1)), rel=1e-7, abs=1e-7)


def test_symmetry_that_is_given():
    partition = Partition.from_basis(dual(hexagon()))
    for rotations, mirror, name in (
        (1, None, "C1"),
        (3, None, "C3"),
        (2, np.pi / 2, "C2v"),
        (None, np.pi / 6, "Cs"),
        (6, 0.0, "C6v"),
    ):
        symmetry = Symmetry.detect(partition, rotations=rotations, mirror=mirror)
        assert symmetry.name == name
        assert len(symmetry.permutations) == (rotations or 1) * (1 if mirror is None else 2)
    with pytest.raises(MeshError, match="4 rotations about its centroid, got cells 1, 2"):
        Symmetry.detect(partition, rotations=4)
    with pytest.raises(MeshError, match=r"a mirror line at 0\.1 through its centroid"):
        Symmetry.detect(partition, rotations=6, mirror=0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rotations": 0}, "rotations from 1 to 217, got 0"),
        ({"tol": 0.1}, "tol from 0 to 0.0001, got 0.1"),
        ({"tol": np.nan}, "finite tol, got nan"),
        ({"x": np.zeros((2, 3))}, r"x of shape \(2, 217\), got \(2, 3\)"),
    ],
)
def test_refused(arguments, message):
    partition = Partition.from_basis(dual(hexagon()))
    with pytest.raises(ValueError, match=message):
        Symmetry.detect(partition, **arguments)
    with pytest.raises(TypeError, match=r"integer for rotations, got 2\.5"):
        Symmetry.detect(partition, rotations=2.5)


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        (([[10**400]], 1, None), TypeError, "permutations as an array of numbers, got an integer"),
        (([[np.inf]], 1, None), ValueError, "finite permutations, got inf at index 0, 0"),
        (([[0.5, 1]], 1, None), TypeError, "permutations as an array of integers, got"),
        (([[0, 1], [1]], 1, None), TypeError, "permutations as an array .* of unequal parts"),
        (([[0, 2]], 1, None), ValueError, "permutations from 0 to 1, got 2 at index 0, 1"),
        (([[0, 1], [1, 0]], 1, None), ValueError, r"permutations of shape \(1, 2\), got \(2, 2\)"),
        (([[0, 1], [1, 1]], 2, None), ValueError, "got none to cell 0 in row 1"),
        (([[0, 1]], 1.5, None), TypeError, "integer for rotations, got 1.5"),
        (([[0, 1], [1, 0]], 1, "x"), TypeError, "number for mirror, got 'x'"),
    ],
)
def test_what_is_no_symmetry(arguments, kind, message):
    with pytest.raises(kind, match=message):
        Symmetry(*arguments)
    assert len(Symmetry([[0, 1], [1, 0]], 1, 0.0)) == 2


def test_right_hand_sides_of_another_length_are_refused():
    _, matrix = symmetric(RigidPunch(SOIL, dual(half())))
    with pytest.raises(ValueError, match=r"values of 66 cells, got shape \(65,\)"):
        matrix.factors.solve(np.ones(65))


def test_saving():
    """Mirror lines without cells on them: h times fewer entries, h^2 times fewer operations."""
    for basis, h in ((triangles(quarters()), 4), (triangles(half()), 2)):
        saving = Symmetry.detect(Partition.from_basis(basis)).saving
        assert saving == pytest.approx((h, h**2, h))
    # C9: one real block and four complex ones, of four times the operations and twice the memory
    saving = Symmetry.detect(Partition.from_basis(PLANS["twisted annulus"][0])).saving
    assert saving == pytest.approx((9, 9**3 / (1 + 4 * 4), 9**2 / (1 + 4 * 2)))


def test_a_cell_alone():
    square = Partition.from_basis(CellBasis(MeshQuad(), ElementQuad0()))
    symmetry = Symmetry.detect(square)
    assert symmetry.name == "C1"
    matrix = SymmetricMatrix.from_rows(symmetry, lambda i: np.full((1, 1), 2.0))
    assert matrix.factors.solve(np.ones(1)) == pytest.approx(0.5)


def test_repr():
    text = repr(Symmetry.detect(Partition.from_basis(triangles(half()))))
    assert "Cs of order 2, a mirror line at 90.00°" in text
    assert "100 in 50 orbits" in text
    assert "2 times fewer entries, 4 times fewer operations, 2 times less memory" in text


def test_how_squares_are_turned_counts():
    """Upright pads on a ring: turned by a fifth or a sixth of a circle they are other ones."""
    names = {}
    for n in (4, 5, 6):
        angle = 2 * np.pi * np.arange(n) / n
        pads = [MeshQuad().translated((np.cos(a) * 2 - 0.5, np.sin(a) * 2 - 0.5)) for a in angle]
        mesh = sum(pads[1:], pads[0])
        partition = Partition.from_basis(CellBasis(mesh, ElementQuad0()))
        names[n] = Symmetry.detect(partition).name
    assert names == {4: "C4v", 5: "Cs", 6: "C2v"}
