import pickle
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import replace

import matplotlib as mpl
import meshio
import numpy as np
import pytest
from elastic_bodies import (
    SOIL,
    block_on,
    kirchhoff,
    load,
    point_load,
    position,
    raft,
    uniform,
)
from marks import slow
from plans import disc, rectangle
from scipy.linalg import block_diag
from scipy.sparse import csr_matrix, diags
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementHex2,
    ElementQuad0,
    ElementQuad1,
    ElementQuadBFS,
    ElementTetP1,
    ElementTetP2,
    ElementTriMorley,
    ElementTriP0,
    ElementTriP1,
    ElementTriP2,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshHex,
    MeshQuad,
    MeshTet,
    MeshTri,
)
from skfem.helpers import dd, ddot, dot, eye, grad, sym_grad
from skfem.helpers import trace as tr
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    ElasticPunch,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    Plate,
    Punches,
    ResolutionWarning,
    RigidPunch,
    trace,
)
from skfem_dual.elements.point_values import vertex_values
from skfem_dual.grids import generate
from skfem_dual.io.structures import write_structure

mpl.use("Agg")
ECCENTRIC = (0.55, 0.1)


@pytest.fixture(scope="module")
def punch():
    return raft(0.1)


@pytest.fixture(scope="module")
def block():
    return ElasticPunch(SOIL, *(parts := block_on("dual"))[:3], **parts[3])


def moved(basis):
    """DOFs of a plate that settles and tilts by one, shape (N, 3)."""
    fields = (lambda x: 1 + 0 * x[0], lambda x: x[0], lambda x: x[1])
    return np.stack([basis.project(field) for field in fields], axis=1)


def test_random_balanced_loads_are_in_equilibrium(punch):
    """Forces and moments of pressures and loads, and of every DOF."""
    rng, planes = np.random.default_rng(0), moved(punch.structure)
    for _ in range(2):
        f = uniform(punch) + 0.3 * sum(
            point_load(punch, x) for x in rng.uniform(-0.4, 0.4, (3, 2))
        )
        s = punch.solve(f)
        assert s.success
        assert s.resultant == pytest.approx(planes.T @ f, abs=1e-10)
        assert s.equilibrium_residual < 1e-10
        assert s.complementarity_residual < 1e-9
        assert planes.T @ s.load_vector() == pytest.approx(s.resultant, abs=1e-10)
        K = punch.stiffness
        unbalanced = K @ s.displacement - f + s.load_vector()
        assert np.abs(unbalanced).max() < 1e-10 * np.abs(f).max()


def test_ground_settles_as_the_structure_where_they_touch(punch):
    s = punch.solve(point_load(punch, ECCENTRIC))
    x = punch.collocation_points
    touching = s.pressure > 0
    assert 0 < touching.sum() < len(touching)
    gap = s.ground_displacement(x) - s.deflection(x)
    assert np.abs(gap[touching]).max() < 1e-8
    assert gap[~touching] == pytest.approx(s.gap[~touching], abs=1e-8)
    assert (gap[~touching] > 0).all()


def test_both_methods_find_the_same(punch):
    f = point_load(punch, ECCENTRIC)
    one, two = (punch.solve(f, method=method) for method in ("active-set", "cg"))
    assert two.pressure == pytest.approx(one.pressure, abs=1e-7 * one.pressure.max())
    assert two.displacement == pytest.approx(one.displacement, abs=1e-8)


def test_start_saves_iterations(punch):
    s = punch.solve(point_load(punch, ECCENTRIC))
    again = punch.solve(point_load(punch, (0.551, 0.1)), start=s)
    alone = punch.solve(point_load(punch, (0.551, 0.1)))
    assert again.pressure == pytest.approx(alone.pressure, abs=1e-7 * alone.pressure.max())
    assert again.iterations < alone.iterations


def test_bilateral_is_linear(punch):
    f, g = uniform(punch), point_load(punch, (0.9, 0.0))
    one, two, both = (punch.solve(load, unilateral=False) for load in (f, g, f - 2 * g))
    assert both.pressure == pytest.approx(one.pressure - 2 * two.pressure, abs=1e-9)
    assert two.pressure.min() < 0
    with pytest.raises(ValueError, match="take tension: they pull"):
        punch.solve(f - 4 * g)
    # cells that press are few here, but all keep contact
    assert punch.solve(-f, unilateral=False).pressure == pytest.approx(-one.pressure, abs=1e-9)
    huge = punch.solve(1e300 * f)
    assert huge.success
    assert huge.force == pytest.approx(1e300 * one.force, rel=1e-6)


def test_many_loads_are_single_ones(punch):
    F = np.column_stack([uniform(punch), point_load(punch, ECCENTRIC)])
    for found in (punch.solve_many(F), punch.solve_many(list(F.T))):
        for s, f in zip(found, F.T, strict=True):
            np.testing.assert_array_equal(s.pressure, punch.solve(f).pressure)


def test_threads_share_a_punch(punch):
    loads = [point_load(punch, (0.08 * i, 0.1)) for i in range(4)]
    alone = [punch.solve(f) for f in loads]
    fresh = replace(punch)  # all that is computed once is computed by some thread
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(fresh.solve, loads))
    for s, t in zip(alone, together, strict=True):
        np.testing.assert_array_equal(s.displacement, t.displacement)


@pytest.mark.parametrize("refined", [False, True])
def test_structure_on_another_mesh(refined):
    """Finer than that of the cells, or a larger one that overhangs: a stiff one is the punch."""
    mesh = rectangle(8)
    cells = DualMesh.from_mesh(mesh).basis()
    larger = mesh.refined() if refined else rectangle(7, 1.5, 1.5)
    plate, K = kirchhoff(larger)
    punch = ElasticPunch(SOIL, cells, plate, 1e9 * K)
    rigid = RigidPunch(SOIL, cells).solve(1.0, ECCENTRIC)
    s = punch.solve(point_load(punch, ECCENTRIC))
    expected = [rigid.collocated_settlement, *rigid.collocated_tilt]
    assert position(s) == pytest.approx(expected, rel=1e-6)
    assert s.pressure == pytest.approx(rigid.pressure, abs=1e-6 * rigid.pressure.max())


def test_overhang_turns_up_the_middle():
    """A plate that overhangs its plan, loaded beyond it, is lifted between."""
    plate, K = kirchhoff(rectangle(8, 2.0, 2.0))
    punch = ElasticPunch(SOIL, DualMesh.from_mesh(rectangle(8)).basis(), plate, 0.02 * K)
    corners = sum(point_load(punch, (x, y)) for x in (-1.9, 1.9) for y in (-1.9, 1.9))
    s = punch.solve(corners)
    assert s.force == pytest.approx(4.0, rel=1e-10)
    assert s.gap[np.hypot(*punch.collocation_points) < 0.3].min() > 0
    assert s.deflection([1.9, 1.9]) > s.deflection([1.0, 1.0]) > s.deflection([0.0, 0.0])


def test_stiff_on_layers():
    ground = LayeredHalfSpace([Layer(0.5, 1.0, 0.3)], HalfSpace(5.0, 0.3))
    punch = raft(1e9, disc(2), substrate=ground)
    s = punch.solve(point_load(punch, ECCENTRIC))
    rigid = RigidPunch(ground, punch.basis).solve(1.0, ECCENTRIC)
    expected = [rigid.collocated_settlement, *rigid.collocated_tilt]
    assert position(s) == pytest.approx(expected, rel=1e-6)


def test_camber():
    """A stiff plate with an initial gap is the rigid punch of that shape."""
    gap = Paraboloid(3.0)
    punch = raft(1e9, gap=gap)
    assert punch.edge == "constant"
    s = punch.solve(point_load(punch, (0.0, 0.0), 0.1))
    rigid = RigidPunch(SOIL, punch.basis, gap=gap).solve(0.1)
    assert s.pressure == pytest.approx(rigid.pressure, abs=1e-6 * rigid.pressure.max())
    assert position(s) == pytest.approx([rigid.settlement, *rigid.tilt], abs=1e-7)


def test_operator_to_a_tolerance(punch):
    f = point_load(punch, ECCENTRIC)
    exact = punch.solve(f)
    fast = replace(punch, rtol=1e-6).solve(f)
    assert fast.displacement == pytest.approx(exact.displacement, abs=1e-5)
    assert fast.resultant == pytest.approx(exact.resultant, abs=1e-10)
    matrix = punch.operator.to_dense()
    p = np.random.default_rng(0).standard_normal(len(matrix))
    assert matrix @ p == pytest.approx(punch.operator @ p, rel=1e-9, abs=1e-12)


def test_a_raft_on_one_pile(punch):
    """Only tilts are left to the ground, which a load in the middle does not cause."""
    to_pile = punch.structure.probes(np.zeros((2, 1)))
    raft = replace(punch, stiffness=punch.stiffness + 3.0 * to_pile.T @ to_pile)
    f = uniform(punch)
    s = raft.solve(f)
    assert s.success, s.message
    load = f[punch.structure.nodal_dofs[0]].sum()
    assert s.force + 3.0 * (to_pile @ s.displacement).item() == pytest.approx(load, rel=1e-9)


@pytest.mark.parametrize("unilateral", [True, *slow(False)])
def test_supports_carry_the_rest(unilateral):
    """Reactions and pressures balance the load, its moments about any point too."""
    free = raft(0.1)
    basis = free.structure
    held = basis.nodal_dofs[0, basis.mesh.boundary_nodes()[:2]]
    punch = replace(free, D=held)
    assert punch.motions.shape[1] == 1
    f = point_load(punch, ECCENTRIC)
    s = punch.solve(f, unilateral=unilateral)
    assert (s.displacement[held] == 0).all()
    assert (np.delete(s.reactions, held) == 0).all()
    assert np.abs(s.reactions).max() > 1e-2
    assert s.resultant == pytest.approx(moved(basis).T @ (f + s.reactions), abs=1e-10)
    # held where it went by itself, nothing is changed
    alone = free.solve(f, unilateral=unilateral)
    same = punch.solve(f, x=alone.displacement, unilateral=unilateral)
    assert same.reactions == pytest.approx(np.zeros(len(f)), abs=1e-8)
    assert same.displacement == pytest.approx(alone.displacement, abs=1e-8)


def mindlin(mesh):
    """Rotations as a vector before the deflection."""
    basis = CellBasis(mesh, ElementVector(ElementTriP2()) * ElementTriP2(), intorder=4)

    @BilinearForm
    def form(t, w, p, v, _):
        return ddot(sym_grad(t), sym_grad(p)) + dot(grad(w) - t, grad(v) - p)

    load = LinearForm(lambda p, v, w: v).assemble(basis)
    return basis, form.assemble(basis), load


@pytest.mark.parametrize("kind", ["morley", "mindlin", "block"])
def test_vertical_forces_that_hold_a_structure(kind, block):
    """All DOFs on one side are held, slopes and horizontal displacements with them."""
    mesh = disc(3)
    if kind == "block":
        basis, cells, load = block.structure, block.basis, -2.0 / 4
        f = LinearForm(lambda v, w: load * v[2]).assemble(basis)
        load = -load * basis.dx.sum()
        held = replace(block, D=basis.get_dofs(lambda x: np.isclose(x[0], basis.mesh.p[0].min())))
    else:
        if kind == "mindlin":
            basis, K, f = mindlin(mesh)
        else:
            basis = CellBasis(mesh, ElementTriMorley(), intorder=2)
            K, f = (
                Plate(0.1, 1e3, 0.2).stiffness(basis),
                LinearForm(lambda v, w: v).assemble(basis),
            )
        cells, load = DualMesh.from_mesh(mesh).basis(), basis.dx.sum()
        side = basis.get_dofs(lambda x: x[0] < -0.8)
        held = ElasticPunch(SOIL, cells, basis, K, D=side)
    s = held.solve(f)
    assert s.success, s.message
    assert abs(s.vertical_reaction) > 1e-3 * load
    assert abs(s.vertical_reaction - s.reactions.sum()) > 1e-4 * load
    assert s.force == pytest.approx(load + s.vertical_reaction, rel=1e-9)


def numbered(basis, number):
    """The basis with DOFs of other numbers."""
    dofs = copy(basis.dofs)
    for name in ("nodal", "edge", "facet", "interior", "element"):
        found = getattr(dofs, f"{name}_dofs")
        if found is not None and found.size:
            setattr(dofs, f"{name}_dofs", number[found].astype(np.int32))
    return CellBasis(basis.mesh, basis.elem, quadrature=basis.quadrature, dofs=dofs)


@pytest.mark.parametrize("kind", ["morley", "mindlin", "block"])
def test_numbers_of_dofs_are_those_of_the_basis(kind, block, tmp_path):
    """scikit-fem numbers those of bases it makes itself anew: forces worked on others."""
    options = {"boundary": "base"} if kind == "block" else {}
    if kind == "block":
        basis, cells = block.structure, block.basis
        form, load = linear_elasticity(*lame_parameters(1.0, 0.3)), lambda v, x: -v[2] * (2 + x[0])
    else:
        mesh = disc(3)
        cells = DualMesh.from_mesh(mesh).basis()
        if kind == "mindlin":
            basis = CellBasis(mesh, ElementVector(ElementTriP2()) * ElementTriP2(), intorder=4)
            form = BilinearForm(
                lambda t, w, p, v, _: (
                    ddot(sym_grad(t), sym_grad(p)) + dot(grad(w) - t, grad(v) - p)
                )
            )
        else:
            basis = CellBasis(mesh, ElementTriMorley(), intorder=4)
            form = BilinearForm(lambda u, v, _: ddot(dd(u), dd(v)))
        load = lambda v, x: v * (2 + x[0])  # noqa: E731
    number = np.random.default_rng(0).permutation(basis.N)
    found = []
    for own in (basis, numbered(basis, number)):
        f = LinearForm(lambda *of: load(of[-2], of[-1].x)).assemble(own)
        # held along a side, so that the vertical forces of supports are asked for
        side = own.get_dofs(lambda x: x[0] < -0.8)
        held = ElasticPunch(SOIL, cells, own, form.assemble(own), D=side, **options)
        found.append(held.solve(f))
    one, other = found
    assert other.success, other.message
    assert other.pressure == pytest.approx(one.pressure, rel=1e-8)
    assert other.displacement[number] == pytest.approx(one.displacement, abs=1e-9)
    assert other.vertical_reaction == pytest.approx(one.vertical_reaction, rel=1e-8)
    assert abs(one.vertical_reaction) > 0.1
    which = 1 if kind == "mindlin" else 0
    values = [vertex_values(s.punch.structure, s.displacement, which) for s in found]
    assert values[1] == pytest.approx(values[0], abs=1e-9)
    meshes = []
    for s in found:
        write_structure(tmp_path / "structure.vtu", s)
        meshes.append(meshio.read(tmp_path / "structure.vtu"))
    for name, data in meshes[0].point_data.items():
        assert meshes[1].point_data[name] == pytest.approx(data, abs=1e-8), name


def test_a_hinge_of_dofs_of_its_own():
    """Slopes on both sides of a line have numbers of their own: more than scikit-fem gives."""
    mesh = MeshTri.init_tensor(np.linspace(-1, 1, 9), np.linspace(-0.5, 0.5, 5))
    plain = CellBasis(mesh, ElementTriMorley(), intorder=4)
    dofs = copy(plain.dofs)
    dofs.element_dofs = dofs.element_dofs.copy()
    right = mesh.p[0, mesh.t].mean(axis=0) > 0
    line = plain.facet_dofs[0, mesh.facets_satisfying(lambda x: abs(x[0]) < 1e-9)]
    for k, old in enumerate(line):
        dofs.element_dofs[:, right] = np.where(
            dofs.element_dofs[:, right] == old, plain.N + k, dofs.element_dofs[:, right]
        )
    dofs.N = plain.N + len(line)
    hinged = CellBasis(mesh, ElementTriMorley(), intorder=4, dofs=dofs)
    K = BilinearForm(lambda u, v, _: 0.05 * ddot(dd(u), dd(v))).assemble(hinged)
    f = LinearForm(lambda v, w: v).assemble(hinged)
    side = hinged.get_dofs(lambda x: np.isclose(x[0], -1)).all("u")
    s = ElasticPunch(SOIL, DualMesh.from_mesh(mesh).basis(), hinged, K, D=side).solve(f)
    assert s.success, s.message
    assert s.force == pytest.approx(2.0 + s.vertical_reaction, rel=1e-9)


def test_facets_inside_a_solid_do_not_face_the_ground(block):
    mesh = block.structure.mesh
    inside = mesh.facets_satisfying(lambda x: np.isclose(x[2], 0.5))
    with pytest.raises(ValueError, match=r"boundary of the solid.*boundaries_only=True"):
        replace(block, boundary=inside).solve(np.zeros(block.structure.N))
    with pytest.raises(ValueError, match="lie inside"):
        trace(mesh, inside)


def test_a_structure_that_touches_nowhere_has_no_position(punch):
    """A weightless plate hinged on one side swung upwards by any amount, with success."""
    basis = punch.structure
    side = basis.nodal_dofs[0, basis.mesh.boundary_nodes()[:2]]
    hinged, x = replace(punch, D=side), np.zeros(basis.N)
    still = hinged.solve(np.zeros(basis.N))
    assert still.success
    assert not still.displacement.any()
    x[side] = -0.01
    with pytest.warns(ConvergenceWarning, match="nothing else tells its position"):
        s = hinged.solve(np.zeros(basis.N), x=x)
    assert not s.success


def test_a_part_without_load_has_no_position():
    """Beside a loaded plate it hovered anywhere, with success."""
    one = MeshTri.init_tensor(np.linspace(0, 3, 5), np.linspace(0, 2, 4))
    mesh = one + one.translated((4.0, 0.0))
    basis, stiffness = kirchhoff(mesh)
    bodies = CellBasis(mesh, ElementTriP0())
    punch = ElasticPunch(SOIL, bodies, basis, stiffness)
    of_one = LinearForm(lambda v, w: (w.x[0] < 3.5) * v).assemble(basis)
    nothing = r"expected loads on all of the structure, got none on the part .* with cell 24 at"
    for method in ("auto", "cg", "active-set"):
        with pytest.raises(ValueError, match=nothing):
            punch.solve(of_one, method=method)
    with pytest.raises(ValueError, match="punch 0: " + nothing):
        Punches([punch]).solve([of_one])
    assert punch.solve(uniform(punch)).success
    assert replace(punch, D=basis.get_dofs(lambda x: x[0] > 3.5)).solve(of_one).success


@pytest.mark.parametrize(("link", "held"), [(0.0, False), (10.0, True)])
def test_parts_hang_together_by_stiffness_of_what_moves(link, held):
    """Neither by entries that are zero nor along a line that is held, about which each one turns:
    the one without a load was anywhere, with success."""
    one = MeshTri.init_tensor(np.linspace(0, 3, 5), np.linspace(0, 2, 4))
    mesh = one + one.translated((4.0, 0.0))
    basis, stiffness = kirchhoff(mesh)
    hinges = [basis.get_dofs(lambda x, c=c: np.isclose(x[0], c)).all("u") for c in (3.0, 4.0)]
    ends = basis.zeros()
    ends[[hinges[0][0], hinges[1][0]]] = 1.0, -1.0
    stored = csr_matrix(np.outer(ends, ends))
    stored.data *= link
    entries = [(K.data, K.row, K.col) for K in (stiffness.tocoo(), stored.tocoo())]
    data, rows, columns = map(np.concatenate, zip(*entries, strict=True))
    linked = csr_matrix((data, (rows, columns)), stiffness.shape)
    assert linked.nnz > stiffness.nnz
    D = np.concatenate(hinges) if held else None
    punch = ElasticPunch(SOIL, CellBasis(mesh, ElementTriP0()), basis, linked, D=D)
    of_one = LinearForm(lambda v, w: (w.x[0] < 3.5) * v).assemble(basis)
    for method in ("auto", "cg", "active-set"):
        with pytest.raises(ValueError, match="got none on the part of the structure with cell 24"):
            punch.solve(of_one, method=method)
    assert punch.solve(uniform(punch)).success


def test_a_part_far_smaller_than_another_bears_its_load():
    one = MeshTri.init_tensor(np.linspace(0, 3, 5), np.linspace(0, 2, 4))
    mesh = one + one.scaled(5e-4).translated((4.0, 0.0))
    basis, stiffness = kirchhoff(mesh)
    punch = ElasticPunch(SOIL, CellBasis(mesh, ElementTriP0()), basis, stiffness)
    solution = punch.solve(LinearForm(lambda v, w: v).assemble(basis))
    assert solution.success
    small = punch.partition.centroids[0] > 3.5
    areas = punch.partition.areas[small]
    assert solution.pressure[small] @ areas == pytest.approx(areas.sum(), rel=1e-4)


def test_a_part_without_load_beside_one_on_springs():
    """It was said to pull."""
    one = MeshTri.init_tensor(np.linspace(0, 3, 5), np.linspace(0, 2, 4))
    mesh = one + one.translated((4.0, 0.0))
    basis, stiffness = kirchhoff(mesh)
    piles = basis.probes(np.array([[0.5, 2.5], [1.0, 1.0]]))
    bodies = CellBasis(mesh, ElementTriP0())
    punch = ElasticPunch(SOIL, bodies, basis, stiffness + 10.0 * piles.T @ piles)
    of_one = LinearForm(lambda v, w: (w.x[0] < 3.5) * v).assemble(basis)
    with pytest.raises(ValueError, match="got none on the part of the structure with cell 24"):
        punch.solve(of_one)


@pytest.mark.filterwarnings("ignore:the structure bends within cells")
def test_work_of_pressures_is_that_on_the_ground():
    """Of a sheet far softer, deflections in the middles of cells may add less than nothing."""
    thin = 0.01
    mesh = MeshHex.init_tensor(np.linspace(0, 3, 7), np.linspace(0, 2, 5), np.array([0, thin]))
    mesh = mesh.with_boundaries({"base": lambda x: x[2] == 0})
    basis = CellBasis(mesh, ElementVector(ElementHex2()))
    stiffness = linear_elasticity(*lame_parameters(1e3, 0.2)).assemble(basis)
    loads = LinearForm(lambda v, w: -(1 + w.x[0] / 3) * v[2] / thin).assemble(basis)
    plan = CellBasis(trace(mesh, "base"), ElementQuad0())
    soil, options = HalfSpace(1e3, 0.3), {"boundary": "base", "edge": "constant"}
    s = ElasticPunch(soil, plan, basis, stiffness, **options).solve(loads)
    assert s.success
    assert s.force == pytest.approx(9.0, rel=1e-9)


def test_displacements_imposed_step_by_step(block):
    """A block pushed down at its top: forces grow with the settlement, those of the top too."""
    basis = block.structure
    top = basis.get_dofs(lambda x: x[2] == 1.0)
    punch = replace(block, D=top)
    assert punch.motions.shape[1] == 0
    found = []
    for step in (0.1, 0.2, 0.4):
        x = np.zeros(basis.N)
        x[basis.nodal_dofs[2, basis.mesh.p[2] == 1.0]] = -step
        s = punch.solve(np.zeros(basis.N), x=x)
        assert -s.reactions[basis.nodal_dofs[2]].sum() == pytest.approx(s.force, rel=1e-10)
        found.append(s.force / step)
    assert found == pytest.approx([found[0]] * 3, rel=1e-9)
    # softer than the ground under a rigid punch, or the block between fixed plates, alone
    rigid = 1 / RigidPunch(SOIL, punch.basis).solve(1.0).settlement
    assert 0.3 * rigid < found[0] < rigid


def test_settled_with_all_vertical_displacements_held(block):
    """Free ones get no load then: what they do not balance is rounding beside that of others."""
    basis = block.structure
    upright = basis.nodal_dofs[2]
    feet = basis.get_dofs(lambda x: x[2] == 0.0).all("u^3")
    first, last = np.argmin(basis.mesh.p[0]), np.argmax(basis.mesh.p[0])
    aside = np.concatenate([basis.nodal_dofs[:2, first], basis.nodal_dofs[1:2, last]])
    for f in (0.0, -1.0):
        forces = []
        for some in (upright, feet):
            loads, x = np.zeros(basis.N), np.zeros(basis.N)
            loads[upright if some is upright else []] = f
            x[some] = -0.01
            s = replace(block, D=np.concatenate([some, aside])).solve(loads, x=x)
            assert s.success
            assert s.equilibrium_residual < 1e-9
            forces.append(s.force)
        assert forces[0] == pytest.approx(forces[1], rel=1e-12)


@pytest.mark.filterwarnings("ignore:the structure bends")
def test_the_remedy_of_few_cells_is_one_for_structures():
    """`refine_to_contact` takes rigid punches."""
    thin = raft(1e-3)
    with pytest.warns(ResolutionWarning, match="smaller cells where it is$"):
        thin.solve(point_load(thin, (0.0, 0.0)))


def test_solid_is_balanced_by_its_load_vector(block):
    f = point_load(block, (0.2, 0.1))
    s = block.solve(f)
    residual = block.stiffness @ s.displacement - f - s.load_vector()
    assert np.abs(residual).max() < 1e-10
    bottom = block.structure.nodal_dofs[2]
    assert s.load_vector()[bottom].sum() == pytest.approx(1.0, rel=1e-12)
    with pytest.raises(TypeError, match=r"expected a basis with \['component'\]"):
        s.load_vector(component=2)


def test_pressures_leave_as_those_of_a_rigid_punch(punch):
    s = punch.solve(point_load(punch, ECCENTRIC))
    basis, values = s.pressure_field()
    assert load.assemble(basis, q=1.0) @ values == pytest.approx(s.force, rel=1e-9)
    basis, values = s.nodal_pressure()
    assert load.assemble(basis, q=1.0) @ values == pytest.approx(s.force, rel=1e-9)
    other = CellBasis(disc(3), ElementTriP1())
    assert s.load_vector(other).sum() == pytest.approx(s.force, rel=1e-6)
    assert 0 < s.contact_area < np.pi
    assert s.contact_region.area == s.contact_area
    assert s.plot().get_figure().axes
    assert "ElasticSolution" in repr(s)
    assert "Deflection" in s._repr_html_()
    assert "3 motions" in repr(punch)
    mpl.pyplot.close("all")


def test_answer_of_a_pickled_plate(punch):
    s = punch.solve(uniform(punch))
    t = pickle.loads(pickle.dumps(s))
    again = t.punch.solve(t.f)
    np.testing.assert_array_equal(again.displacement, s.displacement)
    np.testing.assert_array_equal(t.deflection([0.2, 0.1]), s.deflection([0.2, 0.1]))
    for array in (t.f, t.displacement, t.reactions, t.pressure, t.gap, t.resultant):
        assert not array.flags.writeable


def test_arrays_changed_later_are_none_of_the_plate():
    """Pickles were of the stiffness and the camber that stand in the arrays now."""
    punch = raft(0.1, disc(2))
    K, gap = punch.stiffness.copy(), np.linspace(0.0, 1e-3, len(punch.partition))
    held = punch.structure.nodal_dofs[0, :2].copy()
    plate = replace(punch, stiffness=K, gap=gap, D=held)
    f = uniform(punch)
    expected = plate.solve(f).displacement
    K.data *= 3
    gap *= 2
    held[:] = 5
    assert np.array_equal(pickle.loads(pickle.dumps(plate)).solve(f).displacement, expected)
    assert replace(plate).solve(f).displacement == pytest.approx(expected, abs=1e-12)


def test_answer_of_a_pickle(block):
    s = block.solve(point_load(block, (0.2, 0.1)))
    t = pickle.loads(pickle.dumps(s))
    x = np.zeros((2, 3, 4))
    assert t.deflection(x).shape == (3, 4)
    np.testing.assert_array_equal(t.deflection(x), s.deflection(x))
    again = t.punch.solve(t.f)
    np.testing.assert_array_equal(again.displacement, s.displacement)


def test_units_do_not_matter():
    """In N and mm, or MN and m."""
    plain = raft(0.1, disc(2))
    s = plain.solve(point_load(plain, ECCENTRIC))
    mesh = disc(2).scaled(1e3)
    dual = DualMesh.from_mesh(mesh)
    plate, K = kirchhoff(dual.refinement)
    rigid = 0.1 / 12 / 0.96 * 1e9 * 7e4
    punch = ElasticPunch(HalfSpace(7e4, 0.0), dual.basis(), plate, rigid * K)
    t = punch.solve(point_load(punch, (550.0, 100.0)))
    assert t.deflection([100.0, 0.0]) * 7e7 == pytest.approx(s.deflection([0.1, 0.0]), rel=1e-9)
    assert t.contact_area / 1e6 == pytest.approx(s.contact_area, rel=1e-3)


def test_contact_of_a_turned_block():
    """Free and soft, on its edge."""

    def area(angle):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        _, basis, _, options = block_on("quadrilaterals", n=5)
        mesh = replace(basis.mesh, doflocs=block_diag(turn, 1.0) @ basis.mesh.p)
        solid = Basis(mesh, basis.elem, intorder=3)
        K = linear_elasticity(*lame_parameters(0.1, 0.3)).assemble(solid)
        cells = CellBasis(trace(mesh, "base"), ElementQuad0())
        body = ElasticPunch(SOIL, cells, solid, K, **options)
        return body.solve(point_load(body, turn @ [0.5, 0.2])).contact_area

    areas = [area(angle) for angle in (0.0, 0.3)]
    assert areas[0] < 3.5
    assert np.ptp(areas) < 1e-6 * areas[0]


def test_refused(block):
    punch = raft(0.1, disc(2))
    cells, plate, K = punch.basis, punch.structure, punch.stiffness
    n = plate.N
    f = uniform(punch)
    holed, with_hole = np.where(np.arange(n) == 7, np.nan, f), K.tolil()
    with_hole[5, 7] = np.nan
    for wrong, message in (
        (dict(structure=MeshTri()), "expected a CellBasis for structure, got MeshTri"),
        (dict(structure=CellBasis), "got the class CellBasis"),
        (dict(substrate=HalfSpace), "expected a substrate such as HalfSpace"),
        (dict(stiffness=None), "expected a sparse matrix for stiffness, got None"),
        (dict(stiffness=(1 + 0.1j) * K), "stiffness of real numbers, got complex128"),
        (dict(D="left"), "D as an array of integers"),
        (dict(D=np.array([0.5])), "D as an array of integers"),
        (dict(component="u"), "an integer for component, got 'u'"),
        (dict(edge=np.zeros(2)), 'edge "singular" or "constant"'),
    ):
        with pytest.raises(TypeError, match=message):
            replace(punch, **wrong)
    with pytest.raises(TypeError, match='method "auto", "active-set" or "cg"'):
        punch.solve(f, method=np.zeros(2))
    assert len(replace(punch, D={}).compliance.fixed) == 0
    small = CellBasis(disc(2).scaled(0.9), ElementTriMorley())
    for wrong, message in (
        (dict(stiffness=K[:-1, :-1]), rf"stiffness of shape \({n}, {n}\).*got \({n - 1}, "),
        (dict(stiffness=with_hole), r"finite stiffness, got K\[5, 7\] = nan, 1"),
        (dict(stiffness=K.astype(np.float32)), "in double precision"),
        (dict(boundary="base"), "boundary of a 3-D solid only"),
        (dict(D=[n]), f"D from 0 to {n - 1}, got {n} at"),
        (dict(gap=np.zeros(3)), "gap"),
        (dict(edge="sharp"), "edge"),
        (dict(component=1), "component from 0 to 0, got 1"),
        (
            dict(structure=small, stiffness=kirchhoff(small.mesh)[1]),
            r"covers all cells, but 0\.5\d+ of their area 3\.14159 lies outside \(19 %",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            replace(punch, **wrong)
    for call, message in (
        (lambda: punch.solve(f[:-1]), rf"f of shape \({n},\), got \({n - 1},\)"),
        (
            lambda: punch.solve(holed),
            "finite f, got nan at DOF 7",
        ),
        (lambda: punch.solve(f, x=f[:-1]), rf"x of shape \({n},\)"),
        (lambda: punch.solve(f, method="newton"), 'method "auto", "active-set" or "cg"'),
        (lambda: punch.solve(f, gap_rtol=2.0), "gap_rtol"),
        (lambda: punch.solve(-f), "they pull"),
        (lambda: punch.solve_many([f, -f]), "load 1: expected loads that pressures"),
        (lambda: punch.solve(point_load(punch, (0.995, 0.0))), "outside of the plan"),
        (lambda: punch.solve(f).deflection([2.0, 0.0]), "lie outside"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    for call, message in (
        (lambda: punch.solve("f"), "f as an array of numbers, got 'f'"),
        (
            lambda: punch.solve(f, start=f),
            "or an ElasticSolution for start",
        ),
        (lambda: punch.solve(f, unilateral="no"), "True or False for unilateral"),
        (lambda: punch.solve_many(3.0), "a sequence for F"),
    ):
        with pytest.raises(TypeError, match=message):
            call()
    with pytest.raises(ValueError, match="the boundary of a 3-D solid"):
        replace(block, boundary=None)
    with pytest.raises(ValueError, match=r"boundary of the mesh, \['base'\], got 'feet'"):
        replace(block, boundary="feet")
    with pytest.raises(ValueError, match="one plane z = const"):
        replace(block, boundary=lambda x: x[0] == -1.0)
    with pytest.raises(ValueError, match=r"lies outside \(100 %\)"):
        replace(block, basis=DualMesh.from_mesh(disc(2).translated((9.0, 0.0))).basis())
    assert cells is punch.basis


@pytest.mark.parametrize(
    ("q", "words"),
    [
        (lambda x: (1 + 0 * x[0], 0 * x[0]), "sliding along x, by"),
        (lambda x: (0 * x[0], 1 + 0 * x[0]), "sliding along y, by"),
        (lambda x: (-x[1], x[0]), "turning about the vertical, by"),
    ],
)
def test_loads_that_nothing_resists(block, q, words):
    form = LinearForm(lambda v, w: q(w.x)[0] * v[0] + q(w.x)[1] * v[1] - 3 * v[2])
    f = form.assemble(block.structure)
    with pytest.raises(ValueError, match=f"neither resists: {words}"):
        block.solve(f)
    upright = block.structure.nodal_dofs[2]
    little = np.where(np.isin(np.arange(len(f)), upright), f, 2e-8 * f)
    with pytest.raises(ValueError, match=f"neither resists: {words}"):
        block.solve(little)
    # held against it, the block stands
    p = block.structure.mesh.p
    corners = [np.hypot(p[0] - x, p[1] - x).argmin() for x in (-1, 1)]
    s = replace(block, D=block.structure.nodal_dofs[:2, corners].ravel()).solve(f)
    assert s.success
    assert s.force == pytest.approx(-f[block.structure.nodal_dofs[2]].sum(), rel=1e-10)


def test_rounding_to_single_precision_holds_no_structure():
    """Its entries resist settlement then, and carried a third of the load, to nowhere."""
    lines = np.linspace(0, 3, 7), np.linspace(0, 2, 5), np.linspace(0, 1, 3)
    mesh = MeshTet.init_tensor(*lines).with_boundaries({"base": lambda x: x[2] == 0})
    basis = CellBasis(mesh, ElementVector(ElementTetP1()))
    K = linear_elasticity(*lame_parameters(1e6, 0.2)).assemble(basis)
    plan = CellBasis(trace(mesh, "base"), ElementTriP0())
    single = K.astype(np.float32)
    for rounded in (single, single.astype(float)):
        with pytest.raises(ValueError, match=r"resists 6 rigid motions.*in double precision"):
            ElasticPunch(SOIL, plan, basis, rounded, boundary="base")
    # held it is good to single precision, and true springs are none of this
    D = basis.get_dofs(lambda x: x[2] == 1).all()
    assert ElasticPunch(SOIL, plan, basis, single, "base", D=D).motions.shape[1] == 0
    springs = np.full(basis.N, 2.0**-10 * K.diagonal().max())
    sprung = (K + diags(springs)).astype(np.float32)
    assert ElasticPunch(SOIL, plan, basis, sprung, "base").motions.shape[1] == 0
    weak = K + diags(1e-7 * springs)
    assert ElasticPunch(SOIL, plan, basis, weak, "base").stiffness.shape == K.shape


def test_supports_that_have_been_eliminated_are_held():
    """With a number on the diagonal: the cell above was taken for a part without a load."""
    mesh = generate.rectangle(8.0, 5.0, n=100)
    basis, K = kirchhoff(mesh)
    plan = DualMesh.from_mesh(mesh).basis()
    f = load.assemble(basis, q=1.0)
    support = basis.nodal_dofs[0, np.hypot(*mesh.p).argmin()]
    kept = np.ones(basis.N)
    kept[support] = 0.0
    held = ElasticPunch(SOIL, plan, basis, 1e3 * K, D=[support]).solve(f)
    eliminated = diags(kept) @ (1e3 * K) @ diags(kept) + diags(1 - kept)
    solution = ElasticPunch(SOIL, plan, basis, eliminated).solve(kept * f)
    assert solution.force == pytest.approx(held.force, rel=1e-6)


@pytest.mark.parametrize("held", [False, True])
def test_sheets_bend_softly_but_not_freely(held):
    """Less than a thousandth as thick as long."""
    thick = 0.01
    mesh = MeshTet.init_tensor(np.linspace(0, 6, 5), np.linspace(0, 4, 4), np.array([0, thick]))
    mesh = mesh.with_boundaries({"base": lambda x: x[2] == 0})
    basis = CellBasis(mesh, ElementVector(ElementTetP2()))
    K = linear_elasticity(*lame_parameters(2.1e8, 0.3)).assemble(basis)
    f = LinearForm(lambda v, w: -78.5 * v[2]).assemble(basis)
    D = basis.get_dofs(lambda x: x[0] == 0).all(["u^1", "u^2"]) if held else None
    plan = DualMesh.from_mesh(trace(mesh, "base")).basis()
    sheet = ElasticPunch(HalfSpace(30e3, 0.3), plan, basis, K, boundary="base", D=D)
    assert sheet.compliance.motions.shape[1] == (1 if held else 6)
    assert sheet.idle_motions.shape[1] == (0 if held else 3)
    solution = sheet.solve(f)
    assert solution.success
    assert solution.force == pytest.approx(78.5 * 24 * thick, rel=1e-9)


@pytest.mark.parametrize("n", [75, 100, 200, 300])
def test_a_strip_of_one_row_of_cells_turns_about_its_axis(n):
    """As no point of its cells resists, and no load along the axis makes it."""
    mesh = MeshQuad.init_tensor(np.linspace(0, 200, n + 1), np.array([0.0, 1.0]))
    basis = CellBasis(mesh, ElementQuadBFS())
    K = BilinearForm(
        lambda u, v, _: 1e4 * ddot(0.8 * dd(u) + 0.2 * eye(tr(dd(u)), 2), dd(v))
    ).assemble(basis)
    strip = ElasticPunch(SOIL, CellBasis(mesh, ElementQuad0()), basis, K)
    bell = lambda x: np.exp(-(((x[0] - 60) / 20) ** 2))  # noqa: E731
    f = LinearForm(lambda v, w: bell(w.x) * v).assemble(basis)
    assert strip.idle_motions.shape[1] == 1
    assert np.abs(f @ strip.idle_motions) < 1e-10 * np.abs(f).sum()
    assert strip.solve(f, unilateral=False).force == pytest.approx(20 * np.sqrt(np.pi), rel=1e-4)
    aside = LinearForm(lambda v, w: bell(w.x) * (1 + 1e-6 * w.x[1]) * v).assemble(basis)
    with pytest.raises(ValueError, match="motions that neither resists"):
        strip.solve(aside, unilateral=False)


def test_plate_that_moves_in_its_plane():
    """Vector-valued structures of 2-D meshes name the DOF and its place."""
    mesh = disc(2)
    basis = Basis(mesh, ElementVector(ElementTriP1(), 3))
    K = BilinearForm(
        lambda u, v, w: sum(u.grad[i, j] * v.grad[i, j] for i in range(3) for j in range(2))
    ).assemble(basis)
    punch = ElasticPunch(SOIL, DualMesh.from_mesh(mesh).basis(), basis, K)
    f = np.zeros(basis.N)
    f[basis.nodal_dofs[2]] = f[basis.nodal_dofs[0]] = 1.0
    with pytest.raises(ValueError, match=r"largest displacement in DOF \d+ at \("):
        punch.solve(f)


@pytest.mark.parametrize("load", [0.0, 10.0])
def test_held_structures_lifted_off_are_in_equilibrium_to_rounding(load):
    """Where nothing presses, forces are measured by those of the DOFs that are held."""
    plate, soil = Plate(0.4, 3e7, 0.2), HalfSpace(3e4, 0.3)
    cells = DualMesh.from_mesh(generate.rectangle(4.0, 3.0, n=60)).basis()
    structure = plate.on(soil, cells).structure
    ends = structure.get_dofs(lambda x: np.isclose(abs(x[0]), 2.0)).all("u")
    x = np.zeros(structure.N)
    x[ends] = -0.01
    f = load * LinearForm(lambda v, w: v).assemble(structure)
    solution = plate.on(soil, cells, D=ends).solve(f, x=x)
    assert solution.success
    assert not solution.pressure.any()
    assert solution.equilibrium_residual < 1e-13


def test_forces_that_do_not_balance_are_no_success(punch, monkeypatch):
    f = uniform(punch)
    assert punch.solve(f).success
    exact = type(punch.compliance).displacements
    off = lambda self, loads: 1.01 * exact(self, loads)  # noqa: E731
    monkeypatch.setattr(type(punch.compliance), "displacements", off)
    with pytest.warns(ConvergenceWarning, match="forces of the structure are off by"):
        solution = punch.solve(f)
    assert not solution.success
    assert solution.equilibrium_residual == pytest.approx(1e-4, rel=0.5)


def test_pressures_that_work_on_a_mechanism_are_told():
    """Reduced integration of the shear of bilinear elements leaves an hourglass, which is zero in
    the middle of each of them; only pressures that grow to the edge work on it."""
    lines = np.linspace(-2, 2, 9), np.linspace(-1.5, 1.5, 7)
    mesh = MeshQuad.init_tensor(*lines)
    element = ElementQuad1() * ElementVector(ElementQuad1())
    basis = CellBasis(mesh, element)
    middles = CellBasis(mesh, element, quadrature=(np.full((2, 1), 0.5), np.ones(1)))
    bending = BilinearForm(lambda w, a, v, b, _: 50 * ddot(sym_grad(a), sym_grad(b)))
    shearing = BilinearForm(lambda w, a, v, b, _: 500 * dot(grad(w) - a, grad(v) - b))
    K = bending.assemble(basis) + shearing.assemble(middles)
    f = LinearForm(lambda v, b, w: v).assemble(basis)
    punch = ElasticPunch(SOIL, CellBasis(mesh, ElementQuad0()), basis, K)
    assert punch.idle_motions.shape == (basis.N, 1)
    with pytest.warns(ConvergenceWarning, match=r'mechanism.*Remedy: .*edge="constant"'):
        assert not punch.solve(f).success
    assert replace(punch, edge="constant").solve(f).success


def test_contact_under_solids_does_not_depend_on_numbers():
    """Stiff in a half, so that what yields at the line of contact differs along it."""
    one, other = lifting(0), lifting(1)
    assert 0.3 < one.contact_area / one.punch.partition.areas.sum() < 0.97
    assert other.force == pytest.approx(one.force, rel=1e-9)
    assert other.contact_modulus == pytest.approx(one.contact_modulus, rel=1e-6)
    assert other.contact_area == pytest.approx(one.contact_area, rel=1e-6)


def lifting(seed):
    """A soft block with a stiff half, its nodes in another order each time."""
    g = np.linspace(0, 2, 7)
    mesh = MeshTet.init_tensor(g, g, g[:3])
    order = np.random.default_rng(seed).permutation(mesh.nvertices)
    mesh = MeshTet(mesh.p[:, order], np.argsort(order)[mesh.t]).with_boundaries(
        {"base": lambda x: x[2] == 0, "top": lambda x: np.isclose(x[2], 2 / 3)}
    )
    basis = CellBasis(mesh, ElementVector(ElementTetP1()))
    soft = mesh.elements_satisfying(lambda x: x[1] < 1)
    stiff = np.setdiff1d(np.arange(mesh.nelements), soft)
    of_one = linear_elasticity(*lame_parameters(1.0, 0.25))
    K = 2e3 * of_one.assemble(basis.with_elements(soft))
    K = K + 1e6 * of_one.assemble(basis.with_elements(stiff))
    top = FacetBasis(mesh, basis.elem, facets="top")
    f = LinearForm(lambda v, w: -50 * w.x[0] ** 5 * v[2]).assemble(top)
    plan = DualMesh.from_mesh(trace(mesh, "base").refined()).basis()
    return ElasticPunch(HalfSpace(30e3, 0.3), plan, basis, K, boundary="base").solve(f)


def three_feet(seed):
    """Three plates under a frame that bends, with nodes numbered by chance."""
    one = MeshTri.init_tensor(*2 * [np.linspace(-0.5, 0.5, 5)])
    mesh = one + one.translated((4.0, 0.0)) + one.translated((8.0, 0.0))
    order = np.random.default_rng(seed).permutation(mesh.nvertices)
    mesh = MeshTri(mesh.p[:, order], np.argsort(order)[mesh.t])
    plate = CellBasis(mesh, ElementTriMorley())
    K = BilinearForm(lambda u, v, w: 2e4 * ddot(dd(u), dd(v))).assemble(plate)
    feet, bent = plate.probes(np.array([[0.0, 4, 8], [0, 0, 0]])), np.array([[1.0, -2, 1]])
    K = K + feet.T @ csr_matrix(1e5 * bent.T @ bent) @ feet
    weight = LinearForm(lambda v, w: 5.0 * v).assemble(plate)
    basis = DualMesh.from_mesh(mesh).basis()
    return ElasticPunch(HalfSpace(3e4, 0.3), basis, plate, K), weight, feet


@pytest.mark.parametrize("seed", range(2))
def test_feet_that_hang_from_a_point_and_turn_there_are_told(seed):
    """What they turn by was whatever the numbering of nodes made it, with success."""
    raft, weight, feet = three_feet(seed)
    with pytest.warns(ConvergenceWarning, match=r"part of the structure with cell .* nowhere"):
        lifted = raft.solve(weight + feet.T @ [300.0, 200.0, -60.0])
    assert not lifted.success
    assert raft.solve(weight + feet.T @ [300.0, 200.0, 100.0]).success


@pytest.mark.parametrize("weight", [1.0, *slow(0.0)])
def test_hinged_slabs_of_which_one_lifts_off_are_told(weight):
    """Without a load of its own what presses on one would turn it about the hinge."""
    one = MeshTri.init_tensor(np.linspace(0, 1, 7), np.linspace(0, 1, 7))
    mesh = one.translated((-1.02, 0.0)) + one
    plate = CellBasis(mesh, ElementTriMorley())
    K = BilinearForm(lambda u, v, w: 1e3 * ddot(dd(u), dd(v))).assemble(plate)
    right = plate.probes(np.array([[0.0, 0.0], [0.2, 0.8]]))
    apart = right - plate.probes(np.array([[-0.02, -0.02], [0.2, 0.8]]))
    slabs = ElasticPunch(
        HalfSpace(1.0, 0.3), CellBasis(mesh, ElementTriP0()), plate, K + 1e4 * apart.T @ apart
    )
    f = weight * LinearForm(lambda v, w: v).assemble(plate)
    f += plate.probes(np.array([[0.6], [0.5]])).T @ [1.0]
    if not weight:
        with pytest.warns(
            ConvergenceWarning, match="presses on the ground nowhere|no convergence"
        ):
            assert not slabs.solve(f).success
    else:
        assert slabs.solve(f).success
