"""What a solution tells: pressures at points and nodes, along the edge, with weighted cells."""

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from marks import slow
from plans import annulus, disc, ellipse, perturbed, polar, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshQuad, MeshTri

from skfem_dual import (
    DualMesh,
    HalfSpace,
    Paraboloid,
    ResolutionWarning,
    RigidPunch,
    RigidPunches,
    moment_rotation,
)
from skfem_dual.contact import exact
from skfem_dual.grids import generate
from skfem_dual.io import read_mesh
from skfem_dual.kernels.once import computed_once

UNIT = HalfSpace(1.0, 0.0)


def solve(mesh, grid="dual", force=1.0, at=(0.0, 0.0), **options):
    dual = DualMesh.from_mesh(mesh)
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    return RigidPunch(UNIT, basis, **options).solve(force, at)


GRIDS = ["dual", "primal"]


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize(
    ("mesh", "stiffness"),
    [
        (disc(4), (2.0, 4 / 3, 4 / 3)),
        (disc(4, graded=True), (2.0, 4 / 3, 4 / 3)),
        (perturbed(disc(4), 0.015), (2.0, 4 / 3, 4 / 3)),
        (
            ellipse(4, 1.0, 0.5),
            (1 / exact.ellipse_settlement(1.0, (1.0, 0.5), 1.0, 0.0), np.nan, np.nan),
        ),
        (rectangle(23), np.pi * np.array([0.733576, 0.662348, 0.662348])),
        (rectangle(16, 1.0, 2.0), np.pi * np.array([1.063836, 1.171241, 3.201667])),
        (annulus(8, 72), (np.pi * 0.6245354, np.nan, np.nan)),
    ],
    ids=["disc", "graded disc", "random disc", "ellipse", "square", "rectangle", "annulus"],
)
def test_settlement_and_tilt_at_600_cells(mesh, stiffness, grid):
    """Exact or independently computed; constants are 7e-3 and 2e-2 off on these meshes."""
    dual = DualMesh.from_mesh(mesh)
    K = RigidPunch(UNIT, dual.basis() if grid == "dual" else dual.primal_basis()).stiffness()
    e = np.abs(np.array(stiffness) / K.diagonal() - 1)[np.isfinite(stiffness)]
    assert e[0] < 3e-4
    assert (e[1:] < 2e-3).all()
    # reciprocity holds up to the error of the discretisation
    assert np.abs(K - K.T).max() < 2e-3 * K[0, 0]


@pytest.mark.parametrize("grid", ["dual", *slow("primal")])
def test_stiffness_is_that_of_the_positions_under_loads(grid):
    """By the work of the pressures, both; for nu = 0 and E = a = 1 it is 2 and 4/3."""
    dual = DualMesh.from_mesh(generate.disc(n=300))
    punch = RigidPunch(UNIT, dual.basis() if grid == "dual" else dual.primal_basis())
    K = punch.stiffness()
    assert K.diagonal() == pytest.approx([2.0, 4 / 3, 4 / 3], rel=1.4e-4)
    assert punch.stiffness(full=True)[:3, :3] == pytest.approx(K, abs=2e-6)
    loaded = punch.solve(1.0, (0.1, -0.2))
    assert K @ [loaded.settlement, *loaded.tilt] == pytest.approx([1.0, 0.1, -0.2], rel=1e-12)


@pytest.mark.parametrize("grid", GRIDS)
def test_order_of_convergence(grid):
    """Settlement of the disc: better than first order by collocation, and closer by work."""
    found = [solve(disc(k), grid) for k in (2, 4)]
    e = [abs(s.collocated_settlement * 2 - 1) for s in found]
    assert np.log2(e[0] / e[1]) / 2 > 1.4
    assert abs(found[1].settlement * 2 - 1) < min(5e-5, e[1])


def test_constant_cells_are_tens_of_times_less_accurate():
    weighted, constant = (
        abs(solve(disc(4), edge=edge).settlement * 2 - 1) for edge in ("singular", "constant")
    )
    assert constant > 20 * weighted


@pytest.mark.parametrize("grid", GRIDS)
def test_pressure_away_from_the_edge(grid):
    """Rms of the relative error farther than 0.1 from the edge, eccentric load."""
    solution = solve(disc(4), grid, at=(0.1, 0.05))
    x = solution.punch.partition.centroids
    x = x[:, np.hypot(*x) < 0.9]
    ratio = solution.pressure_at(x) / exact.circle_pressure(x, 1.0, 1.0, (0.1, 0.05))
    assert np.sqrt(np.mean((ratio - 1) ** 2)) < 3e-3


def test_pressure_near_the_edge_grows_like_the_exact_one():
    solution = solve(disc(5))
    angle = np.linspace(0.1, 6.3, 50)
    for distance in (0.05, 0.01, 1e-3):
        apothem = np.hypot(*solution.punch.partition.polygons.p).max() * np.cos(np.pi / 128)
        x = (apothem - distance) * np.stack([np.cos(angle), np.sin(angle)])
        ratio = solution.pressure_at(x) / exact.circle_pressure(x, 1.0, 1.0)
        assert np.median(ratio) == pytest.approx(1, abs=0.06)


@pytest.mark.parametrize(
    ("grid", "edge"),
    [("dual", "singular"), *[(g, "constant") for g in GRIDS], *slow(("primal", "singular"))],
)
def test_pressure_at_points_has_the_means_of_the_cells(grid, edge):
    """Quadrature of the pressure over cells gives back the unknowns."""
    solution = solve(perturbed(rectangle(3), 0.05), grid, at=(0.2, 0.1), edge=edge)
    fan = solution.punch.fan
    fine = MeshTri.init_refdom().refined(4)
    share = np.vstack([1 - fine.p.sum(axis=0), fine.p])[:, fine.t].mean(axis=1)
    x = np.einsum("ikt,ks->its", fan.p[:, fan.t], share)
    p = solution.pressure_at(x.reshape(2, -1)).reshape(x.shape[1:])
    means = np.bincount(fan.cell, fan.areas * p.mean(axis=1)) / solution.punch.partition.areas
    if edge == "constant":
        assert means == pytest.approx(solution.pressure, rel=1e-12)
    else:  # where p is singular the midpoint rule loses some of it
        root = solution.punch.weights.root[fan.t].min(axis=0)
        inner = np.minimum.reduceat(root, fan.starts[:-1]) > 1e-9
        assert inner.any()
        assert means[inner] == pytest.approx(solution.pressure[inner], rel=1e-4)
        assert means == pytest.approx(solution.pressure, rel=0.1)


def test_pressure_outside_and_on_the_edge():
    solution = solve(rectangle(6))
    p = solution.pressure_at([[0.0, 1.0, 1.5], [0.3, 0.3, 0.0]])
    assert p[0] > 0
    assert p[1] == np.inf
    assert p[2] == 0
    with pytest.raises(ValueError, match=r"shape \(2, \.\.\.\)"):
        solution.pressure_at([0.0, 0.0, 0.0])


@pytest.mark.parametrize("grid", GRIDS)
def test_nodal_pressure(grid):
    """Inner nodes take the pressure there, edge nodes stay finite."""
    solution = solve(disc(4), grid, at=(0.1, 0.0))
    basis, p = solution.nodal_pressure()
    x = basis.doflocs
    inner = np.hypot(*x) < 0.9
    expected = exact.circle_pressure(x[:, inner], 1.0, 1.0, (0.1, 0.0))
    assert p[inner] == pytest.approx(expected, rel=2.5e-2)
    edge = basis.mesh.boundary_nodes()
    assert np.isfinite(p).all()
    if grid == "dual":
        plain = solution.nodal_pressure(conserve=False)[1]
        assert np.array_equal(plain[edge], solution.pressure[edge])
        assert np.array_equal(plain[inner], p[inner])


@pytest.mark.parametrize("grid", GRIDS)
def test_edge_coefficient_of_the_disc(grid):
    """p sqrt(d) -> (P + 3 M . x / a^2) / (2 pi a sqrt(2 a)); within 1 % at 513 cells."""
    mesh = read_mesh(Path(__file__).parent / "data" / "disc.msh")
    edge = solve(mesh, grid).edge_coefficient()
    assert edge.values == pytest.approx(1 / (2 * np.pi * np.sqrt(2)), rel=1e-2)
    edge = solve(mesh, grid, at=(0.1, -0.05)).edge_coefficient()
    expected = (1 + 3 * (0.1 * edge.x[0] - 0.05 * edge.x[1])) / (2 * np.pi * np.sqrt(2))
    assert edge.values == pytest.approx(expected, abs=1e-2 * expected.max())
    assert (edge.contour == 0).all()
    # in order along the circle, counter-clockwise
    assert (np.diff(edge.arc) > 0).all()
    turn = np.diff(np.unwrap(np.arctan2(edge.x[1], edge.x[0])))
    assert (turn > 0).all()
    assert edge.arc[-1] == pytest.approx(2 * np.pi, rel=0.03)


@pytest.mark.parametrize("refinements", [3, 4])
def test_edge_coefficient_on_flat_cells(refinements):
    """At a curved edge the corners of the polygon lie off the curve by a part of flat cells."""
    edge = solve(disc(refinements, graded=True), "dual").edge_coefficient()
    exact = 1 / (2 * np.pi * np.sqrt(2))
    # slopes carry on from cells around to the edge: values of cells alone spread less
    assert edge.values == pytest.approx(exact, rel=0.055)
    assert edge.values.mean() == pytest.approx(exact, rel=0.015)


def test_edge_coefficient_has_a_contour_for_every_hole():
    edge = solve(annulus(6, 48)).edge_coefficient()
    assert np.array_equal(np.unique(edge.contour), [0, 1])
    for contour, length in zip((0, 1), sorted((np.pi, 2 * np.pi)), strict=True):
        radius = np.hypot(*edge.x[:, edge.contour == contour])
        assert np.ptp(radius) < 2e-2
        assert np.diff(edge.arc[edge.contour == contour]).min() > 0
        assert length > 0
    # the outer edge carries more
    outer = np.hypot(*edge.x) > 0.75
    assert edge.values[outer].mean() > edge.values[~outer].mean()
    with pytest.raises(ValueError, match='edge="singular"'):
        solve(annulus(6, 48), edge="constant").edge_coefficient()


def test_any_partition_has_weights():
    """Quadrilaterals and polar grids with a seam settle alike."""
    soil = HalfSpace(1.0, 0.25)
    ring = RigidPunch(soil, CellBasis(polar(10, 80), ElementQuad0())).solve(1.0)
    # the 80-gon, smaller than the circle, settles a little more
    area = 40 * np.sin(np.pi / 40)
    assert ring.settlement == pytest.approx(0.46875 * np.sqrt(np.pi / area), rel=2e-4)
    squares = CellBasis(MeshQuad().refined(4).scaled(2.0).translated((-1.0, -1.0)), ElementQuad0())
    assert RigidPunch(soil, squares).solve(1.0).settlement == pytest.approx(0.406795, rel=1e-3)
    _, p = ring.nodal_pressure()
    assert np.isfinite(p).all()


def test_ground_and_punch_agree_also_with_weights():
    problem = RigidPunch(UNIT, DualMesh.from_mesh(perturbed(rectangle(8), 0.03)).basis())
    solution = problem.solve(1.0, at=(0.1, 0.2))
    x = problem.collocation_points
    assert solution.displacement(x) == pytest.approx(
        solution.punch_displacement(x, collocated=True)
    )
    far = solution.displacement([[40.0], [8.0]])
    assert far[0] == pytest.approx(UNIT.influence(np.hypot(40 - 0.1, 8 - 0.2)), rel=3e-4)


def test_named_edges():
    mesh = rectangle(12).with_defaults()
    whole = RigidPunch(UNIT, DualMesh.from_mesh(mesh).basis())
    three = RigidPunch(
        UNIT, DualMesh.from_mesh(mesh).basis(), edge_boundaries=["left", "top", "bottom"]
    )
    right = np.nonzero((mesh.p[0] == 1.0) & (np.abs(mesh.p[1]) < 0.5))[0]
    assert whole.weights.root[right] == pytest.approx(0)
    assert three.weights.root[right] ** 2 == pytest.approx(1 - np.abs(mesh.p[1, right]))
    assert three.solve(1.0).edge_coefficient().x[0].max() < 1.0
    # on triangles as well, and by a single name
    single = RigidPunch(UNIT, CellBasis(mesh, ElementTriP0()), edge_boundaries="left")
    assert single.solve(1.0).edge_coefficient().x[0] == pytest.approx(-1.0)
    facets, inside = mesh.boundaries["left"], np.nonzero(mesh.f2t[1] >= 0)[0][:2].tolist()
    assert np.array_equal(
        RigidPunch(UNIT, single.basis, edge_boundaries=facets.tolist()).weights.ribs,
        single.weights.ribs,
    )
    with pytest.raises(ValueError, match="facets on the edge of the plan"):
        RigidPunch(UNIT, single.basis, edge_boundaries=inside)
    for nothing in ([], ()):
        with pytest.raises(ValueError, match="facets on the edge of the plan"):
            RigidPunch(UNIT, CellBasis(mesh, ElementTriP0()), edge_boundaries=nothing)
    with pytest.raises(ValueError, match=r"got \[''\]"):
        RigidPunch(UNIT, CellBasis(mesh, ElementTriP0()), edge_boundaries="")
    with pytest.raises(TypeError, match="text for a name in edge_boundaries, got 3"):
        RigidPunch(UNIT, single.basis, edge_boundaries=["left", 3])
    with pytest.raises(ValueError, match=r"edge_boundaries from 0 to .*, got 100000 at index 1"):
        RigidPunch(UNIT, single.basis, edge_boundaries=[facets[0], 100000])
    with pytest.raises(TypeError, match="names or facets for edge_boundaries, got 5"):
        RigidPunch(UNIT, CellBasis(mesh, ElementTriP0()), edge_boundaries=5)
    with pytest.raises(ValueError, match=r"\['bottom', 'left', 'right', 'top'\], got \['rim'\]"):
        RigidPunch(UNIT, CellBasis(mesh, ElementTriP0()), edge_boundaries=["left", "rim"])
    with pytest.raises(ValueError, match='edge "singular" where edge_boundaries'):
        RigidPunch(UNIT, CellBasis(mesh, ElementTriP0()), edge="constant", edge_boundaries="left")


def test_invariance():
    """Turned, moved, scaled and renumbered: the same answer."""
    mesh = perturbed(rectangle(7), 0.04)
    rng = np.random.default_rng(0)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    number = rng.permutation(mesh.p.shape[1])
    t = number[mesh.t][:, rng.permutation(mesh.nelements)]
    p = 3.0 * (turn @ mesh.p + 5.0)
    other = MeshTri(p[:, np.argsort(number)].copy(), t.copy())
    one = solve(mesh, at=(0.1, 0.2))
    two = solve(other, at=3.0 * turn @ [0.1, 0.2], origin=(15.0, 15.0))
    assert two.settlement == pytest.approx(one.settlement / 3)
    assert two.pressure[number] == pytest.approx(one.pressure / 9)
    assert two.tilt == pytest.approx(turn @ one.tilt / 9)


def test_shared_arrays_are_read_only():
    """What is stored, and what is computed once, of all that a user holds."""
    solution = solve(rectangle(6), at=(0.7, 0.0))
    with pytest.warns(ResolutionWarning):  # at last it stands on a few cells
        curve = moment_rotation(solution.punch, 1.0, steps=3)
    group = RigidPunches([solution.punch])
    held = [
        solution,
        solution.punch,
        solution.bounds,
        solution.contact_region,
        solution.edge_coefficient(),
        solution.punch.basis.dual,
        solution.punch.solve_many([{"force": 1.0}]),
        solution.punch.stiffness(full=True),
        curve,
        group,
        group.solve([{"force": 1.0}]),
    ]
    writeable = []
    for thing in held:
        names = (
            {f.name for f in fields(thing)} if hasattr(thing, "__dataclass_fields__") else set()
        )
        kinds = ((name, getattr(type(thing), name, None)) for name in dir(type(thing)))
        names |= {name for name, kind in kinds if isinstance(kind, computed_once)}
        for name in names:
            value = getattr(thing, name)
            if isinstance(value, np.ndarray) and value.flags.writeable:
                writeable.append(f"{type(thing).__name__}.{name}")
    assert writeable == []


def test_imposed_positions_take_no_work():
    """Two triangles resist no tilt, so that no work tells one; imposed it is what it is."""
    basis = DualMesh.from_mesh(MeshTri()).primal_basis()
    solution = RigidPunch(UNIT, basis, origin=(0.5, 0.5)).solve(settlement=0.1, tilt=(0.0, 0.02))
    assert np.array_equal(solution.positions, [[0.1, 0.0, 0.02]] * 3)
    assert "Settlement W0     0.1" in str(solution)


def test_an_origin_off_the_plan_is_named():
    """To which positions imposed, and loads on ground that may pull, refer without an error."""
    far = DualMesh.from_mesh(generate.disc(n=60).translated((30.0, 0.0))).basis()
    soil = HalfSpace(1.0, 0.0)
    found = RigidPunch(soil, far).solve(1.0, unilateral=False)
    assert re.search(r"Origin +\(0, 0\), 29 off the plan", str(found))
    for origin in ((30.0, 0.0), (31.0, 0.0)):  # on the edge it is near enough
        near = RigidPunch(soil, far, origin=origin).solve(1.0, unilateral=False)
        assert "Origin" not in str(near)


def test_cells_in_contact_are_not_to_be_changed():
    found = solve(disc(3), at=(0.5, 0.0))
    assert found.contact.dtype == np.int32
    for values in (found.contact, found.centre_of_pressure):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_origins_beside_the_plan_are_named_in_any_unit(unit):
    """On a circle they are beside the polygon that stands for it, but not off the plan."""
    basis = DualMesh.from_mesh(disc(2).scaled(unit)).basis()
    way = np.array([np.cos(np.pi / 16), np.sin(np.pi / 16)])  # between two corners
    for away, named in (1.0, False), (1.1, True), (2.0, True), (20.0, True):
        punch = RigidPunch(UNIT, basis, origin=tuple(away * unit * way))
        assert ("Origin" in repr(punch.solve(1.0, unilateral=False))) == named


@pytest.mark.parametrize("method", ["auto", "active-set"])
def test_the_misfit_told_where_the_punch_hardly_moves(method):
    """A shape that begins above the ground: nothing settles under the origin, much around it."""
    basis = DualMesh.from_mesh(disc(3)).basis()
    plain = RigidPunch(UNIT, basis, gap=Paraboloid(1.0)).solve(0.2)
    lifted = RigidPunch(UNIT, basis, gap=lambda x: (x**2).sum(axis=0) / 2 - plain.settlement)
    told = lifted.solve(0.2, method=method)
    assert abs(told.settlement) < 1e-9
    misfit = float(re.search(r"displacement (\S+)", repr(told))[1])
    assert misfit < 1e-6
