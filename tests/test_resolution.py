"""Cells too coarse for the ground: warned of where settlements are off, and not elsewhere."""

import re
import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from marks import slow
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshQuad, MeshTri

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    MeshError,
    Paraboloid,
    ResolutionWarning,
    RigidPunch,
    RigidPunches,
    postprocess,
)
from skfem_dual.elements.resolution import coarseness, too_coarse
from skfem_dual.grids.generate import disc
from skfem_dual.grids.partition import Partition
from skfem_dual.ground.rigid_disc import RigidDisc

COARSE = DualMesh.from_mesh(disc(n=60)).basis()
BASES = {n: DualMesh.from_mesh(disc(n=n)).basis() for n in (150, 300, 600)}


@cache
def exact_settlement(ground, n=240):
    """Of the unit disc under a unit force, by the dual integral equation."""
    c = 2 * np.pi * ground.singular_coefficient
    x, weights = np.polynomial.legendre.leggauss(n)
    t, weights = (x + 1) / 2, weights / 2
    gauss, gauss_weights = np.polynomial.legendre.leggauss(10)
    edges = np.linspace(0, min(30 / ground.lengths[0], 2.0 * n), 2 * n)
    k = (edges[:-1, None] + np.diff(edges)[:, None] * (gauss + 1) / 2).ravel()
    rest = k * ground.symbol(k) / c - 1
    rest *= (np.diff(edges)[:, None] * gauss_weights / 2).ravel()
    waves = np.cos(np.outer(t, k))
    phi = np.linalg.solve(np.pi / 2 * np.eye(n) + (waves * rest) @ waves.T * weights, np.ones(n))
    return c / (2 * np.pi * (weights @ phi))


def test_the_equation_meets_boussinesq():
    same = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], HalfSpace(1.0, 0.25))
    assert exact_settlement(same) == pytest.approx(0.46875, rel=1e-9)


def check_warning(basis, poisson, thickness, edge="singular", limits=(0.003, 0.05)):
    """Errors above the second limit are warned of, those below the first are not; what is told is
    the error of settlements that are right by their order."""
    ground = LayeredHalfSpace([Layer(thickness, 1.0, poisson)], "bonded")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        punch = RigidPunch(ground, basis, edge=edge)
    told = [float(re.search(r"([\d.]+) %", str(w.message))[1]) / 100 for w in caught]
    assert [w.category for w in caught] in ([], [ResolutionWarning])
    with warnings.catch_warnings():  # settlements of the wrong sign are no success
        warnings.simplefilter("ignore", ConvergenceWarning)
        settlement = punch.solve(1.0, unilateral=False).settlement
    error = abs(settlement / exact_settlement(ground) - 1)
    assert caught or error <= limits[1]
    assert not caught or error >= limits[0]
    assert all(error / 1.5 < off < 10 * error for off in told if error < 1)


@pytest.mark.parametrize("n", [150, *slow(300, 600)])
@pytest.mark.parametrize("poisson", [0.49, *slow(0.0, 0.3, 0.45, 0.5)])
@pytest.mark.parametrize("thickness", [0.1, 0.01, *slow(0.02)])
def test_warned_where_settlements_are_off(n, poisson, thickness):
    check_warning(BASES[n], poisson, thickness)


@pytest.mark.parametrize("poisson", [0.49, *slow(0.3, 0.5)])
def test_warned_of_constant_pressures(poisson):
    """On ground that does not vary 60 of them are 2.4 % off."""
    for basis in (COARSE, BASES[150]):
        for thickness in (0.1, 0.01):
            check_warning(basis, poisson, thickness, "constant", (0.005, 0.08))


def test_warned_of_ground_that_varies_too_fast_for_any_cells():
    """As where a modulus per depth is given for its part of that at the surface."""
    ground = GradedHalfSpace.init_linear(1e6, 0.3, 2e6)
    message = too_coarse(ground, COARSE.partition)
    assert message.endswith("Remedy: ground in the units of the mesh")


@pytest.mark.parametrize(
    ("poisson", "thickness"), [(0.5, 0.07), (0.5, 0.13), *slow((0.49, 0.04), (0.3, 0.1))]
)
def test_warned_on_graded_meshes(poisson, thickness):
    """Whose largest cells are three times as wide as the median."""
    mesh = DualMesh.from_mesh(disc(n=120, graded=0.3))
    for basis in (mesh.basis(), mesh.primal_basis()):
        check_warning(basis, poisson, thickness)


@cache
def strip_compliance(ground, grid, length, along, across):
    """Settlement and tilts of a rectangle of width 1 under a unit force and moments about its
    middle, with so many cells along and across."""
    x, y = (np.linspace(-size / 2, size / 2, n + 1) for size, n in ((length, along), (1, across)))
    mesh = MeshQuad.init_tensor(x, y)
    if grid == "quadrilaterals":
        basis = CellBasis(mesh, ElementQuad0())
    elif grid == "triangles":
        basis = CellBasis(mesh.to_meshtri(), ElementTriP0())
    else:
        basis = DualMesh.from_mesh(mesh.to_meshtri()).basis()
    return np.linalg.inv(RigidPunch(ground, basis).stiffness()).diagonal()


def strip_errors(ground, grid, length, across, exact):
    """Errors of these, and what is told of them."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = strip_compliance(ground, grid, length, length * across, across)
    return np.abs(found / exact - 1), [str(w.message) for w in caught]


@pytest.mark.parametrize("across", [3, *slow(2, 4, 6, 8)])
@pytest.mark.parametrize(
    ("poisson", "thickness"), [(0.48, 0.05), *slow((0.3, 0.05), (0.48, 0.02))]
)
@pytest.mark.parametrize("grid", ["quadrilaterals", *slow("triangles", "dual")])
def test_warned_of_few_cells_across_narrow_plans(across, poisson, thickness, grid):
    """Pressures fall from the middle of a strip to its edge as they do under no disc."""
    ground = LayeredHalfSpace([Layer(thickness, 1.0, poisson)], "bonded")
    finest = 16 if thickness > 0.02 else 24
    exact = strip_compliance(ground, "dual", 4, 4 * finest, finest)
    off, told = strip_errors(ground, grid, 4, across, exact)
    assert told or (off[0] <= 0.06 and off.max() <= 0.15)
    sizes = [float(re.search(r"([\d.]+) %", message)[1]) / 100 for message in told]
    assert all(off.max() / 10 < size < 20 * off.max() for size in sizes)


@pytest.mark.parametrize("rows", [1, 2, *slow(3, 4)])
@pytest.mark.parametrize("grid", ["triangles", *slow("quadrilaterals", "dual")])
@pytest.mark.parametrize(
    "ground",
    [
        LayeredHalfSpace([Layer(0.1, 1.0, 0.3)], HalfSpace(10.0, 0.3)),
        *slow(
            LayeredHalfSpace([Layer(0.3, 1.0, 0.3)], HalfSpace(3.0, 0.3)),
            GradedHalfSpace.init_linear(1.0, 0.3, 10.0),
            GradedHalfSpace.init_linear(1.0, 0.3, 300.0),  # like springs: constant pressures
        ),
    ],
    ids=lambda ground: f"{ground.lengths[0]:.3g}",
)
def test_warned_of_tilts_across_few_cells(ground, grid, rows):
    """Settlements are right, tilts are what pressures inside of cells resist with."""
    if grid != "triangles" and rows == 1:
        pytest.skip("a row of cells has no tilt across")

    exact = strip_compliance(ground, "quadrilaterals", 4, 32, 10)
    off, messages = strip_errors(ground, grid, 4, rows, exact)
    told = [re.search(r"tilts across .* ([\d.]+) %", message) for message in messages]
    assert told or off.max() < 0.15
    assert not told or off.max() > 0.02
    assert all(off.max() / 3 < float(own[1]) / 100 < 6 * off.max() for own in told if own)


@pytest.mark.parametrize("poisson", [0.3, *slow(0.0)])
@pytest.mark.parametrize("grid", ["dual", *slow("primal")])
@pytest.mark.parametrize("thickness", [0.02, 0.001, *slow(0.005, 0.002)])
def test_warned_of_soft_layers_far_thinner_than_cells(poisson, thickness, grid):
    """They are springs, but for 0.3 thicknesses at the edge: pressures that grow to it are told
    of where they are off, and are not what is chosen where no cell tells them from springs."""
    ground = LayeredHalfSpace([Layer(thickness, 1.0, poisson)], "bonded")
    basis = COARSE if grid == "dual" else COARSE.dual.primal_basis()
    spring = thickness * (1 + poisson) * (1 - 2 * poisson) / (1 - poisson) / np.pi
    warned = too_coarse(ground, Partition.from_basis(basis)) is not None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        singular = RigidPunch(ground, basis, edge="singular")
        settlement = singular.solve(1.0, unilateral=False).settlement
    error = abs(settlement / spring - 1)
    assert warned or error <= 0.02
    assert error > 0.005 or thickness <= 0.005 or not warned
    constant = RigidPunch(ground, basis, edge=None if thickness <= 0.005 else "constant")
    assert constant.edge == "constant"
    assert constant.solve(1.0).settlement == pytest.approx(spring, rel=0.01)


@pytest.mark.parametrize("hardness", [0.5, *slow(0.05, 6.0, 100.0)])
def test_skins_without_effect_have_none(hardness):
    """By their springs and their bending settlements change by 3e-4 at most; on both grids, by a
    fast summation, where the punch lifts off, and beside another one."""
    below = HalfSpace(1.0, 0.3)
    ground = LayeredHalfSpace([Layer(1e-5, hardness, 0.3)], below)
    dual = DualMesh.from_mesh(disc(n=80))
    for basis, options in ((dual.basis(), {}), (dual.primal_basis(), {"rtol": 1e-6})):
        for at in ((0.0, 0.0), (0.5, 0.1)):
            found, bare = (
                RigidPunch(soil, basis, **options).solve(1.0, at) for soil in (ground, below)
            )
            assert found.success
            assert found.settlement == pytest.approx(bare.settlement, rel=5e-4)
            assert found.tilt == pytest.approx(bare.tilt, abs=2e-3 * bare.settlement)
    other = DualMesh.from_mesh(disc(n=60).translated((2.5, 0.0))).basis()
    both, bare = (
        RigidPunches([RigidPunch(soil, dual.basis()), RigidPunch(soil, other, origin=(2.5, 0.0))])
        .solve([{"force": 1.0}, {"force": 1.0}])
        .solutions
        for soil in (ground, below)
    )
    for s, t in zip(both, bare, strict=True):
        assert s.settlement == pytest.approx(t.settlement, rel=5e-4)


def test_the_remedy_helps():
    ground = LayeredHalfSpace([Layer(0.05, 1.0, 0.5)], "bonded")
    with pytest.warns(ResolutionWarning, match="150|1[0-9]{2} cells of a size"):
        punch = RigidPunch(ground, BASES[150])
    advised = int(too_coarse(ground, punch.partition).split()[-2])
    finer = DualMesh.from_mesh(disc(n=int(1.1 * advised))).basis()
    found = RigidPunch(ground, finer).solve(1.0, unilateral=False).settlement
    assert found == pytest.approx(exact_settlement(ground), rel=0.03)


def test_units_and_place_do_not_matter():
    def layer(unit):
        return LayeredHalfSpace([Layer(0.05 * unit, 1.0 / unit, 0.49)], "bonded")

    h = np.array([0.15, 0.05, 0.01])
    plain = coarseness(layer(1.0), h)
    assert coarseness(layer(1e3), 1e3 * h) == pytest.approx(plain, rel=1e-9)
    assert (np.diff(plain) < 0).all()


@pytest.mark.parametrize("size", [1e-60, 1e-19, 1e90, *slow(1e19, 1e60)])
def test_sizes_that_are_no_numbers_in_the_end(size):
    """In units far from the plan's cells are refused, in others the answer is the same."""
    basis = DualMesh.from_mesh(disc(n=30).scaled(size)).basis()
    ground = LayeredHalfSpace([Layer(size, 1.0, 0.3)], HalfSpace(0.1, 0.3))
    if 1e-30 < size < 1e30:
        plain = LayeredHalfSpace([Layer(1.0, 1.0, 0.3)], HalfSpace(0.1, 0.3))
        same = RigidPunch(plain, DualMesh.from_mesh(disc(n=30)).basis()).solve(1.0).settlement
        assert RigidPunch(ground, basis).solve(size).settlement == pytest.approx(same, rel=1e-9)
    else:
        with pytest.raises(MeshError, match=r"cells of sizes from 1e-20 to 1e.20.*choose units"):
            RigidPunch(ground, basis)


@pytest.mark.parametrize(
    "ground",
    [
        HalfSpace(1.0, 0.5),
        GradedHalfSpace.init_linear(1.0, 0.3, 5.0),
        LayeredHalfSpace([Layer(0.02, 10.0, 0.3)], HalfSpace(1.0, 0.3)),
        LayeredHalfSpace([Layer(0.5, 1.0, 0.3), Layer(0.02, 10.0, 0.3)], HalfSpace(1.0, 0.3)),
    ],
)
def test_thin_layers_that_do_no_harm(ground):
    assert too_coarse(ground, Partition.from_basis(BASES[150])) is None


@pytest.mark.parametrize(
    ("thickness", "found", "exact"), [(0.1, 1.4, 1875.0), *slow((0.3, 1.02, 102.97))]
)
def test_bonded_bases_on_layers_that_keep_their_volume(thickness, found, exact):
    """Against axisymmetric finite elements (Q2/Q1, graded to the edge), to 5e-4."""
    punch = RigidPunch(LayeredHalfSpace([Layer(thickness, 1.0, 0.5)], "bonded"), BASES[150])
    if exact < 200:
        stiffness = punch.stiffness(full=True, rough=True)
    else:
        with pytest.warns(ResolutionWarning, match=r"bonded base may be off by some \d\d %"):
            stiffness = punch.stiffness(full=True, rough=True)
    assert 1.0 < stiffness[0, 0] / exact < found
    assert np.isfinite(punch.stiffness(full=True)).all()  # a relaxed base needs no finer cells


def test_bonded_bases_that_move_against_forces_are_refused():
    ground = LayeredHalfSpace([Layer(0.03, 1.0, 0.5)], "bonded")
    with pytest.warns(ResolutionWarning, match="settlements and tilts may be off"):
        punch = RigidPunch(ground, CellBasis(disc(n=110), ElementTriP0()))
    with pytest.raises(MeshError, match=r"moves against forces: 187 cells .* Remedy: about"):
        punch.stiffness(full=True, rough=True)


@pytest.mark.parametrize(
    ("ground", "edge"),
    [
        (GradedHalfSpace.init_linear(1.0, 0.3, 1e3), "constant"),
        (LayeredHalfSpace([Layer(1e-3, 1.0, 0.45)], "bonded"), "constant"),
        (LayeredHalfSpace([Layer(5e-4, 1.0, 0.3), Layer(0.0995, 1.0, 0.3)], "bonded"), "singular"),
        *slow(
            (GradedHalfSpace.init_power(1.0, 0.3, 0.5, 1e-3), "singular"),
            (GradedHalfSpace.init_power(1.0, 0.3, 0.45, 9e-4), "singular"),
            (GradedHalfSpace.init_linear(1.0, 0.5, 1e3), "constant"),
            (GradedHalfSpace.init_power(1.0, 0.3, 0.8, 1e-3), "constant"),
            (GradedHalfSpace.init_power(1.0, 0.3, 0.2, 1e-3), "singular"),
            (LayeredHalfSpace([Layer(1e-3, 1.0, 0.3)], HalfSpace(300.0, 0.3)), "constant"),
            (LayeredHalfSpace([Layer(1e-3, 1.0, 0.3)], HalfSpace(3.0, 0.3)), "singular"),
            (LayeredHalfSpace([Layer(1e-3, 1.0, 0.3)], HalfSpace(0.03, 0.3)), "singular"),
        ),
    ],
)
def test_edges_on_ground_that_varies_over_far_less_than_cells(ground, edge):
    """Against the equations of the disc."""
    exact = RigidDisc.on(ground, 1.0).settlement
    mesh = disc(n=300)
    for basis in (BASES[150], DualMesh.from_mesh(mesh).primal_basis()):
        punch = RigidPunch(ground, basis)
        assert punch.edge == edge
        assert punch.solve(1.0).settlement == pytest.approx(exact, rel=0.011)


def test_edges_follow_the_ground():
    steep, even = GradedHalfSpace.init_linear(1.0, 0.3, 1e3), HalfSpace(1.0, 0.3)
    punch = RigidPunch(steep, BASES[150])
    assert punch.edge == "constant"
    assert replace(punch, substrate=even).edge == "singular"
    assert replace(RigidPunch(even, BASES[150]), substrate=steep).edge == "constant"
    with pytest.warns(ResolutionWarning, match='no law of the edge .* Remedy: edge="constant"'):
        RigidPunch(steep, BASES[150], edge="singular")
    shaped = RigidPunch(steep, BASES[150], gap=Paraboloid(50.0))
    assert not shaped.edge_by_contact
    assert RigidPunch(even, BASES[150], gap=Paraboloid(50.0)).edge_by_contact


@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_bounds_have_the_edge_of_the_solution(grid):
    """Cells of the other grid are of another size, for which another edge would be chosen."""
    mesh = MeshTri.init_sqsymmetric().refined(2)
    dual, origin = DualMesh.from_mesh(mesh), tuple(mesh.p.mean(axis=1))
    ground = GradedHalfSpace.init_linear(1.0, 0.3, 384.0)
    grids = {"dual": dual.basis(), "primal": dual.primal_basis()}
    punches = {name: RigidPunch(ground, basis, origin=origin) for name, basis in grids.items()}
    assert {name: str(punch.edge) for name, punch in punches.items()} == {
        "dual": "singular",
        "primal": "constant",
    }
    solution = punches[grid].solve(1.0)
    low, high = solution.bounds.settlement
    assert low < solution.settlement < high


def test_fields_on_ground_like_springs_do_not_grow_to_the_edge():
    """Pressures are those of the cells, but for a thousandth of the radius."""
    ground = LayeredHalfSpace([Layer(1e-3, 1.0, 0.3)], "bonded")
    dual = DualMesh.from_mesh(disc(n=150))
    on = [RigidPunch(ground, basis).solve(1.0) for basis in (dual.basis(), dual.primal_basis())]
    assert not on[0].punch.sharp_edge
    assert postprocess(*on).values.max() == pytest.approx(1 / np.pi, rel=5e-3)


def test_fields_of_tilted_punches_on_springs_are_planes():
    """To the edge, where they fell and grew again as towards a singular one."""
    ground = LayeredHalfSpace([Layer(1e-3, 1.0, 0.3)], "bonded")
    for basis in (BASES[150], BASES[150].dual.primal_basis()):
        found = RigidPunch(ground, basis).solve(1.0, at=(0.1, 0.0))
        basis, values = found.pressure_field()
        plane = (1 + 0.4 * basis.mesh.p[0]) / np.pi
        assert np.abs(values - plane).max() < 0.02 / np.pi
