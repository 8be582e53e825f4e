"""Reports of structures under load cases, and beside rigid footings, against what was solved."""

import dataclasses
import pickle
import re
from html import unescape
from types import SimpleNamespace

import numpy as np
import pytest
from elastic_shapes import SOIL, block, plate
from marks import slow
from scipy.sparse import csr_matrix
from skfem import (
    CellBasis,
    ElementQuad0,
    ElementTriMorley,
    ElementTriP0,
    LinearForm,
    MeshQuad,
    MeshTri,
)

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    ElasticPunch,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    PeriodicGround,
    Plate,
    Punches,
    RigidPunch,
    RigidPunches,
    bearing_pressure,
    column_load,
)
from skfem_dual.elements.balance import field_resultant
from skfem_dual.grids.generate import polygon, rectangle
from skfem_dual.report import report_html
from skfem_dual.report.bodies import bodies_of
from skfem_dual.report.data import report_data
from skfem_dual.report.details import Details
from skfem_dual.report.figures import off_the_plan
from skfem_dual.report.numbers import Standing
from skfem_dual.report.page import THIN, number, table
from skfem_dual.report.results import point_names
from skfem_dual.report.structure import imposed_on

pytestmark = pytest.mark.usefixtures("undrawn")


def tables(text, head):
    """Rows of a section: the name of each, and the numbers in it."""
    (part,) = re.findall(rf"<section>\n<h2>{head}</h2>(.*?)</section>", text, re.DOTALL)
    rows = re.findall(r'<tr><th scope="row">(.*?)</th>(.*?)</tr>', part, re.DOTALL)
    return {
        unescape(name): [float(v) for v in re.findall(r'<data value="([^"]*)"', cells)]
        for name, cells in rows
    }


@pytest.fixture(scope="module")
def cases():
    """A raft under a load in its middle, and one aside: its own answers."""
    calm = plate(factor=2.0)
    punch = calm.punch
    aside = punch.structure.probes(np.array([[0.3], [0.1]])).T @ [1.0]
    return {"calm": calm, "aside": punch.solve(0.5 * calm.f + 3.0 * aside)}


@pytest.fixture(scope="module")
def group():
    alone = plate(n=100)
    pad = DualMesh.from_mesh(rectangle(1.0, 1.0, n=30).translated((2.1, 0.5))).basis()
    punch = RigidPunch(SOIL, pad, origin=(2.1, 0.5))
    return Punches([alone.punch, punch]).solve([alone.f, {"force": 0.5, "at": (0.05, -0.1)}])


def test_loads_balance_pressures_in_every_case(cases):
    """The loads by hand: one in the middle, and another at a point."""
    text = report_html(cases, points=[(0.2, 0.2)])
    found = tables(text, "Check of the resultants")
    expected = {"calm": (2.0, 0.0, 0.0), "aside": (4.0, 0.9, 0.3)}
    what = "force [F]", "first moment along x [F·L]", "first moment along y [F·L]"
    for case, loads in expected.items():
        for name, load in zip(what, loads, strict=True):
            imposed, pressed, residual = found[f"{case}: {name}"]
            assert (imposed, pressed) == pytest.approx((load, load), abs=1e-2)  # of quadrature
            assert imposed == pytest.approx(pressed, abs=1e-9)
            assert residual < 1e-10


def test_cases_of_a_structure(cases):
    text = report_html(cases, points=[(0.2, 0.2)], allowable=1.0)
    assert "<h1>Structure on elastic ground</h1>" in text
    results = tables(text, "Results")
    for name, solution in cases.items():
        corners = solution.deflection(0.999999 * solution.punch.partition.polygons.p)
        assert results[name][0] == solution.force
        every = [*corners, *solution.deflection_range]
        assert results[name][3:5] == pytest.approx([min(every), max(every)], rel=1e-4)
    at = [s.deflection([[0.2], [0.2]])[0] for s in cases.values()]
    assert results["P1"][2:4] == pytest.approx([min(at), max(at)], rel=1e-4)
    governs = tables(text, "Envelope")
    largest = [bearing_pressure(s) for s in cases.values()]
    assert governs["Largest pressure"] == [max(largest)]
    borne = tables(text, "Bearing pressure")
    assert [borne[name][1] for name in cases] == largest
    assert text.count("<figure>") == 4  # mesh, depth, and two of the case that governs


def test_a_structure_beside_a_footing(group):
    raft, pad = group.solutions
    text = report_html({"raft": raft, "pad": {"load": pad}}, points=[(0.1, 0.1), (1.7, 0.2)])
    assert "<h1>Foundations on elastic ground</h1>" in text
    check = tables(text, "Check of the resultants")
    assert check["raft, load: force [F]"][:2] == pytest.approx([1.0, 1.0])
    assert check["pad, load: first moment along y [F·L]"][:2] == pytest.approx([-0.05, -0.05])
    assert "P1" in tables(text, "Results, raft")
    assert "pad, P2" in tables(text, "Settlements of corners and points")
    assert tables(text, "Results, pad")["load"][0] == pad.settlement
    assert "How far the numbers may be off, pad" in text


def test_the_solver_is_told_of_each_body(cases, group):
    """Each by its governing case, named where there are several."""
    raft, pad = group.solutions
    text = report_html({"raft": raft, "pad": pad})
    (part,) = re.findall(r"<h2>Solver</h2>(.*?)</section>", text, re.DOTALL)
    assert re.findall(r"<th scope=\"col\">(Solver.*?)</th>", part) == [
        "Solver, raft",
        "Solver, pad",
    ]
    assert re.findall(r"Result</th><td>(.*?)</td>", part) == [raft.message, pad.message]
    assert part.count("Versions") == 1
    assert "a structure of finite elements with a smooth base and a rigid, smooth punch" in part
    assert "Case</th>" not in part
    (part,) = re.findall(r"<h2>Solver</h2>(.*?)</section>", report_html(cases), re.DOTALL)
    assert "Case</th><td>aside</td>" in part
    assert cases["aside"].message in part


def test_what_holds_a_structure_takes_part_of_its_loads():
    """A solid held sideways settles freely; a raft that is held down does not."""
    cube = block(tilt=0.5, n=3)
    assert imposed_on(cube) == pytest.approx([4.0, 2 / 3, 0.0], abs=1e-9)
    free = plate(n=100)
    held = dataclasses.replace(free.punch, D=free.punch.structure.nodal_dofs[0, :3])
    solution = held.solve(free.f)
    assert np.isnan(imposed_on(solution)[0])
    row = tables(report_html({"held": solution}), "Check of the resultants")
    assert row["held: force [F]"] == [solution.force]
    row = tables(report_html(solution), "Check of the equilibrium")
    total = imposed_on(free)[0]
    assert row["Vertical force that holds it"] == pytest.approx([solution.force - total], rel=1e-6)


def test_a_case_without_a_solution_is_glaring(cases):
    lost = dataclasses.replace(cases["calm"], success=False, message="gave up")
    text = report_html({"aside": cases["aside"], "calm": lost})
    assert "<h1>NOT CONVERGED: Structure on elastic ground</h1>" in text
    assert "NO SOLUTION in the case calm" in text
    assert "calm (NO SOLUTION)" in text
    assert "1 of 2" in re.sub("<.*?>", "", text)


def test_cases_of_a_shaped_raft_that_presses_over_its_edge_in_one_of_them(cases):
    """Pressures there are those of a copy of it."""
    flat = cases["calm"].punch
    uniform = LinearForm(lambda v, w: 1.0 * v).assemble(flat.structure)
    punch = dataclasses.replace(flat, gap=lambda x: 0.05 * (x**2).sum(axis=0), edge=None)
    light, heavy = punch.solve(5e-3 * cases["calm"].f), punch.solve(uniform)
    assert light.punch is not heavy.punch
    for found in ({"light": light, "heavy": heavy}, {"raft": {"light": light, "heavy": heavy}}):
        (body,) = bodies_of(found, Details())
        assert body.names == ("light", "heavy")


def test_cases_from_other_processes_are_of_one_body(cases, group):
    copy = pickle.loads(pickle.dumps(cases["aside"]))
    (body,) = bodies_of({"calm": cases["calm"], "aside": copy}, Details())
    assert body.names == ("calm", "aside")
    softer = dataclasses.replace(copy.punch, stiffness=0.5 * copy.punch.stiffness)
    other = dataclasses.replace(copy, punch=softer)
    assert len(bodies_of({"one": cases["aside"], "softer": other}, Details())) == 2


def test_wrong_bodies_are_refused(cases, group):
    other = RigidPunch(
        HalfSpace(2.0, 0.0), DualMesh.from_mesh(rectangle(1.0, 1.0, n=60)).basis()
    ).solve(1.0)
    calm, raft = cases["calm"], group.solutions[0]
    softer = dataclasses.replace(raft.punch, stiffness=0.5 * raft.punch.stiffness)
    soft = dataclasses.replace(raft, punch=softer)
    for wrong, message in (
        ({}, "expected solutions of some bodies by their names, got none"),
        ({"raft": {}}, "expected cases of 'raft' by their names, got none"),
        ({"raft": {"a": calm, "b": soft}}, "cases of one body for 'raft', got solutions of 2"),
        ({"raft": calm, "pad": other}, "expected bodies on the same ground, got several. Remedy"),
    ):
        with pytest.raises(ValueError, match=message):
            report_html(wrong)
    for wrong, message in (
        ({"raft": calm, "pad": 1.0}, "footing 'pad', got 1.0"),
        ({"raft": {"a": calm, "b": 2}}, "case 'b' of 'raft', got 2"),
        ({"raft": {1: calm}}, "the name of a case of 'raft', got 1"),
    ):
        with pytest.raises(TypeError, match=message):
            report_html(wrong)


def test_corners_are_not_called_as_points_wanted():
    """P1, P2 and so on are those of ``points``."""
    names = point_names(SimpleNamespace(points=np.zeros((2, 60))))
    assert names[:3] + names[24:26] == ["A", "B", "C", "Z", "A1"]
    assert len(set(names)) == 60
    assert not [name for name in names if name.startswith("P")]


def test_numbers_of_a_column_have_equally_many_decimals():
    """The largest has its digits, and each the whole of it for programs."""
    rows = [(name, number(v, 4)) for name, v in (("a", 10.5), ("b", 0.2106), ("c", -1e-9))]
    text = str(table(rows, ("", "w"), numeric=True))
    cells = dict(re.findall(r'<data value="([^"]*)">([^<]*)</data>', text))
    assert cells == {"10.5": "10.50", "0.2106": "0.21", "-1e-09": "0.00"}
    whole = [("a", number(1234.0)), ("b", number(-900.0)), ("c", "none"), ("d", number(np.nan))]
    text = str(table(whole, ("", "w"), numeric=True))
    assert re.findall(r">([^<>\n]+)</(?:data|td)>", text) == [f"1{THIN}234", "−900", "none", "–"]
    none = table([("a", number(1.25)), ("b", number(0.0))], ("", "w"), numeric=True)
    assert re.findall(r"([^>]*)</data>", none) == ["1.25", "0"]
    # too far apart
    apart = [("a", number(10.5)), ("b", number(1.2345e-05))]
    assert "10.5<" in table(apart, ("", "w"), numeric=True)
    assert "× 10<sup>−5</sup>" in table(apart, ("", "w"), numeric=True)


def test_names_of_corners_stand_off_the_plan():
    """Outside of outer corners, in holes and in what a re-entrant corner leaves."""
    corners = np.array([[0.0, 4, 4, 0], [0, 0, 4, 4]])
    mesh = polygon(corners, holes=[1.5 + corners / 4], n=150)
    punch = RigidPunch(HalfSpace(1.0, 0.3), DualMesh.from_mesh(mesh).basis(), origin=(2.0, 2.0))
    standing = Standing(punch.solve(1.0))
    towards = off_the_plan(standing)
    assert np.hypot(*towards) == pytest.approx(1.0)
    middle = standing.points - 2.0
    outer = np.abs(middle).max(axis=0) > 1
    assert np.count_nonzero(outer) == np.count_nonzero(~outer) == 4
    expected = np.where(outer, 1, -1) * middle / np.hypot(*middle)
    assert towards == pytest.approx(expected, abs=1e-6)


def test_a_structure_that_may_settle_and_not_turn():
    """Where its loads act is not known, since a spring takes part of their moments."""
    mesh = rectangle(8.0, 5.0, n=60)
    basis = CellBasis(mesh, ElementTriMorley())
    ends = basis.probes(np.array([[0.5, -0.5], [0.0, 0.0]])).toarray()
    spring = 1e5 * np.outer(ends[0] - ends[1], ends[0] - ends[1])
    stiffness = Plate(0.5, 30e6, 0.2).stiffness(basis) + csr_matrix(spring)
    raft = ElasticPunch(HalfSpace(30e3, 0.3), DualMesh.from_mesh(mesh).basis(), basis, stiffness)
    solution = raft.solve(column_load(basis, (1.0, 0.5), 900.0, sides=(0.5, 0.5)))
    assert np.isnan(imposed_on(solution)).tolist() == [False, True, False]
    page = report_html(solution)
    assert "Resultant of the loads" in page
    assert page.count("acting at") == 1


def test_a_plate_without_a_load():
    """It has no point where pressures act, which ended the page."""
    raft = Plate(0.5, 30e6, 0.2).on(SOIL, DualMesh.from_mesh(rectangle(8.0, 5.0, n=60)).basis())
    nothing = np.zeros(raft.structure.N)
    some = column_load(raft.structure, (1.0, 0.5), 900.0, sides=(0.5, 0.5))
    assert "<html" in report_html(raft.solve(nothing))
    assert "<html" in report_html({"none": raft.solve(nothing), "some": raft.solve(some)})


def test_moments_of_a_plate_and_where_they_are_extreme():
    """Twisting ones, too."""
    made = Plate(0.3, 30e6, 0.2)
    raft = made.on(HalfSpace(30e3, 0.3), DualMesh.from_mesh(rectangle(8.0, 5.0, n=60)).basis())
    s = raft.solve(column_load(raft.structure, (2.0, 1.0), 500.0, sides=(0.5, 0.5)))
    mesh = raft.structure.mesh
    middles = mesh.p[:, mesh.t].mean(axis=1)
    found = tables(report_html(s, plates={"": made}), "Bending moments")
    for name, m in zip(("mx", "my", "mxy"), made.moments(s), strict=True):
        expected = [(m[i], *middles[:, i]) for i in (m.argmin(), m.argmax())]
        assert found[f"load: {name}"] == pytest.approx(np.ravel(expected))


def test_moments_of_a_plate_on_a_part_of_its_mesh():
    mesh = MeshTri.init_tensor(np.linspace(-3.0, 3.0, 13), np.linspace(-1.0, 1.0, 5))
    own = np.nonzero(mesh.p[0, mesh.t].mean(axis=0) > 1.0)[0]
    made, basis = Plate(0.2, 30e6, 0.2), CellBasis(mesh, ElementTriMorley(), elements=own)
    K, plan = made.stiffness(basis), CellBasis(mesh.restrict(own), ElementTriP0())
    none = np.nonzero(K.diagonal() == 0.0)[0]
    s = ElasticPunch(HalfSpace(30e3, 0.3), plan, basis, K, D=none).solve(
        column_load(basis, (2.0, 0.3), 100.0, sides=(0.3, 0.3))
    )
    found, m = tables(report_html(s, plates={"": made}), "Bending moments"), made.moments(s)
    assert m.shape == (3, len(own))
    x = mesh.p[:, mesh.t[:, own[m[0].argmax()]]].mean(axis=1)
    assert found["load: mx"][4:] == pytest.approx(x)


def test_a_plate_that_is_held_above_the_ground():
    """Its largest settlement is a rise."""
    raft = Plate(0.4, 30e6, 0.2).on(SOIL, DualMesh.from_mesh(rectangle(4.0, 4.0, n=40)).basis())
    held = raft.structure.get_dofs().all("u")
    raft, x = dataclasses.replace(raft, D=held), np.zeros(raft.structure.N)
    x[held] = -0.01
    (body,) = bodies_of({"raft": {"up": raft.solve(np.zeros(raft.structure.N), x=x)}}, Details())
    values = {e.quantity: e.value for e in body.extremes}
    assert values["largest_settlement"] == pytest.approx(-0.01)
    assert values["contact_share"] == 0.0


def test_loads_of_joined_footings():
    """Each was told to carry the force of both, and the load stood nowhere."""
    soil, origins = HalfSpace(30e3, 0.3), ((-2.0, 0.0), (2.0, 0.0))
    duals = [DualMesh.from_mesh(rectangle(2.0, 2.0, n=30).translated(x)) for x in origins]
    punches = [RigidPunch(soil, d.basis(), origin=x) for d, x in zip(duals, origins, strict=True)]
    pair = RigidPunches(punches, joined=[(0, 1)], names=["left", "right"])
    load = {"force": 400.0, "at": (3.0, 0.0)}
    alone = pair.solve([load])
    with pytest.warns(ConvergenceWarning, match="'gone': body left"):
        left, right = pair.solve_many({"wind": [load], "gone": [{**load, "at": (30.0, 0.0)}]})
    for k, cases in enumerate((left, right)):
        assert cases.force[0] == pytest.approx(alone[k].force, rel=1e-12)
        assert np.isnan(cases.force[1])
        resultant = alone[k].centre_of_pressure + origins[k]
        assert cases.point[:, 0] == pytest.approx(resultant, rel=1e-9, abs=1e-9)
    assert left.force[0] + right.force[0] == pytest.approx(400.0, rel=1e-12)
    moment = left.force[0] * left.point[0, 0] + right.force[0] * right.point[0, 0]
    assert moment == pytest.approx(400.0 * 1.0, rel=1e-9)  # at 3 from the origin of the first
    many = {"left": left, "right": right}
    for found in (alone, many):
        for each in report_data(bodies_of(found, Details()))["footings"]:
            case = each["cases"][0]
            assert set(case["load"].values()) == {None}
            assert case["load_of_body"]["punches"] == ["left", "right"]
            assert case["load_of_body"]["force"] == 400.0
            assert case["load_of_body"]["at"] == [3.0, 0.0]
        assert "These are loads of left and right together" in report_html(found)
    assert "of which this takes what is found" in report_html(alone[1])
    framed = RigidPunches(punches, stiffness=np.eye(6)).solve([{"force": 1.0}, {"force": 2.0}])
    assert "The frame takes part of these loads" in report_html(framed)


def test_quantities_of_all_sizes_stand_in_one_envelope():
    """In newtons and pascals settlements are a millionth of pressures, and no rounding."""
    pad = DualMesh.from_mesh(rectangle(4.0, 3.0, n=60).translated((2.0, 1.5))).basis()
    punch = RigidPunch(HalfSpace(30e6, 0.3), pad, origin=(2.0, 1.5))
    cases = punch.solve_many({"A": {"force": 1e6}, "B": {"force": 1.2e6, "at": (0.3, 0.2)}})
    text = report_html(cases)
    (part,) = re.findall(r"<h2>Envelope</h2>(.*?)</section>", text, re.DOTALL)
    largest = {e.quantity: e.value for e in cases.envelope()}["largest_settlement"]
    (shown,) = re.findall(r'Largest settlement</th><td.*?<data value="[^"]*">(.*?)</data>', part)
    assert float(shown) == pytest.approx(largest, rel=1e-4)
    (shown,) = re.findall(r'Largest pressure</th><td.*?<data value="([^"]*)">', part)
    assert f"{float(shown):,.0f}".replace(",", THIN) in part  # as elsewhere on the page


@pytest.mark.parametrize(
    ("units", "n"),
    [
        ("kN,m", 60),
        ("N,mm", 60),
        *slow(("N,m", 60), ("kN,m", 120), ("N,mm", 120), ("N,m", 120)),
    ],
)
def test_an_area_made_for_the_allowable_pressure_keeps_it(units, n):
    force, length = {"kN,m": (1.0, 1.0), "N,mm": (1e3, 1e3), "N,m": (1e3, 1.0)}[units]
    basis = DualMesh.from_mesh(rectangle(2.0 * length, 2.0 * length, n=n)).basis()
    solution = RigidPunch(HalfSpace(30e3 * force / length**2, 0.3), basis).solve(1e3 * force)
    allowable = 250.0 * force / length**2
    text = report_html(solution, units=units, allowable=allowable)
    assert "kept by the mean pressures, and exceeded by the largest" in text
    assert "EXCEEDED" in report_html(solution, units=units, allowable=0.999999 * allowable)


def test_cases_of_a_group():
    """Each a solution of all bodies, as of those under a frame."""
    ground, mesh = HalfSpace(30e3, 0.3), rectangle(2.0, 2.0, n=30)
    feet = [
        RigidPunch(ground, DualMesh.from_mesh(mesh.translated((x, 0.0))).basis(), origin=(x, 0))
        for x in (0.0, 6.0)
    ]
    frame = np.zeros((6, 6))
    frame[np.ix_([0, 3], [0, 3])] = 1e4 * np.array([[1, -1], [-1, 1]])
    group = RigidPunches(feet, stiffness=frame, names=["left", "right"])
    cases = {
        name: group.solve([{"force": a}, {"force": b}])
        for name, a, b in (("live", 100.0, 300.0), ("dead", 200.0, 200.0))
    }
    left, right = bodies_of(cases, Details())
    assert (left.name, right.name) == ("left", "right")
    assert left.cases.names == ("live", "dead")
    assert [s.force for s in right.cases.solutions] == [cases[name][1].force for name in cases]
    assert "left" in report_html(cases, units="kN,m")
    other = RigidPunches(feet, names=["a", "b"]).solve([{"force": 1.0}] * 2)
    with pytest.raises(ValueError, match="cases of the same bodies"):
        bodies_of({**cases, "other": other}, Details())


def test_gaps_at_corners_are_the_largest():
    """What the page says of all is not less than what its table says of one."""
    basis = DualMesh.from_mesh(rectangle(8.0, 5.0, n=60)).basis()
    raft = Plate(0.3, 30e6, 0.2).on(HalfSpace(30e3, 0.3), basis)
    s = raft.solve(column_load(raft.structure, (2.0, 1.0), 500.0, sides=(0.5, 0.5)))
    (body,) = bodies_of(s, Details())
    x = 0.9999 * np.array([[-4.0, 4.0, 4.0, -4.0], [-2.5, -2.5, 2.5, 2.5]])
    gaps = s.ground_displacement(x) - s.deflection(x)
    assert gaps.max() > 1.01 * s.gap.max()
    assert body.largest_gap[0] == pytest.approx(gaps.max(), rel=1e-3)


def test_data_tells_what_was_solved(cases, group):
    """All fields of a structure and its cases, by public attributes and by hand."""
    data = report_data(bodies_of(cases, Details(allowable=2.0)))
    (body,), punch = data["structures"], cases["calm"].punch
    cells, basis = punch.partition, punch.structure
    exact = {
        "name": "", "cells": len(cells), "edge": "singular",
        "edge_boundaries": None, "collocation": "centroid",
        "shape": "flat", "kind": "plate", "plate": None, "columns": [],
        "element": type(basis.elem).__name__, "elements": basis.mesh.nelements, "dofs": basis.N,
        "held": len(punch.compliance.fixed),
    }  # fmt: skip
    assert {k: body[k] for k in exact} == exact
    numbers = {
        "origin": punch.origin, "centroid": punch.centre, "area": cells.areas.sum(),
        "extent": [cells.polygons.p.min(axis=1), cells.polygons.p.max(axis=1)],
        "areas": cells.areas, "centroids": cells.centroids.T,
    }  # fmt: skip
    for name, value in numbers.items():
        assert np.array(body[name]) == pytest.approx(np.array(value)), name
    known = {"grid", "points", "circle_radius", "envelope", "stress_profile", "cases"}
    assert known == set(body) - set(exact) - set(numbers)
    for told, s in zip(body["cases"], cases.values(), strict=True):
        largest = bearing_pressure(s)
        values = {
            "force": s.force, "point": s.resultant[1:] / s.force + punch.origin,
            "first_moments": s.resultant[1:],
            "reactions": s.vertical_reaction, "equilibrium_residual": s.equilibrium_residual,
            "mean_settlement": cells.areas @ s.cell_deflections / cells.areas.sum(),
            "contact_area": s.contact_area, "contact_share": s.contact_area / cells.areas.sum(),
            "load.force": s.force - s.vertical_reaction,
            "pressure.mean": s.mean_pressure, "pressure.largest": largest,
            "pressure.min_of_cells": s.pressure.min(), "pressure.max_of_cells": s.pressure.max(),
            "utilisation.mean": s.mean_pressure / 2, "utilisation.largest": largest / 2,
            "complementarity_residual": s.complementarity_residual,
            "displacement_residual": s.displacement_residual,
            "in_cells.pressure": s.pressure, "in_cells.first_moments": s.mean_moments.T,
            "in_cells.deflection": s.cell_deflections, "in_cells.gap": s.gap,
        }  # fmt: skip
        for name, value in values.items():
            found = told
            for key in name.split("."):
                found = found[key]
            assert np.array(found) == pytest.approx(np.array(value), abs=1e-9), name
        # at a corner, which is a little farther off than the outermost points
        assert s.gap.max() < told["largest_gap"] < 1.1 * s.gap.max()
        assert told["deflection"]["least"] <= s.cell_deflections.min()
        assert told["deflection"]["largest"] >= s.cell_deflections.max()
    (pair,) = report_data(bodies_of(group, Details()))["between"]
    centres = [s.footprint.centre for s in group.solutions]
    assert pair["distance"] == pytest.approx(np.hypot(*(centres[1] - centres[0])))
    ratio = abs(pair["differential_settlement"]) / pair["distance"]
    assert pair["angular_distortion"] == pytest.approx(ratio)


def test_footings_without_a_resultant_are_shown():
    """On ground that pulls: pages, pictures and fields of them ended in an error."""
    dual = DualMesh.from_mesh(rectangle(2.0, 1.0, n=50))
    two = DualMesh.from_mesh(rectangle(2.0, 1.0, n=50).translated((2.5, 0.0)))
    pads = [RigidPunch(SOIL, d.basis(), origin=at) for d, at in ((dual, (0, 0)), (two, (2.5, 0)))]
    calm, loaded = RigidPunches(pads).solve([{"force": 0.0}, {"force": 1.0}], unilateral=False)
    assert np.abs(calm.pressure).max() > 0.01
    field, p = calm.pressure_field()
    assert np.abs(field_resultant(field, p)).max() < 1e-9
    text = report_html({"calm": calm, "loaded": loaded})
    assert "No isobars" not in text
    assert "<img" in calm._repr_html_()


def test_isobars_of_net_uplift():
    """They were refused by their own scale."""
    dual = DualMesh.from_mesh(rectangle(2.0, 1.0, n=50))
    punch = RigidPunch(SOIL, dual.basis())
    assert "No isobars" not in report_html(punch.solve(-1.0, at=(0.1, 0.0), unilateral=False))


def test_solutions_of_one_footing_by_names_are_its_cases():
    """They were footings in one place, without an envelope."""
    punch = RigidPunch(SOIL, DualMesh.from_mesh(rectangle(2.0, 1.0, n=50)).basis())
    found = {"a": punch.solve(1.0), "b": punch.solve(2.0)}
    (body,) = bodies_of(found, Details())
    assert body.cases.names == ("a", "b")
    (alone,) = bodies_of({"a": found["a"]}, Details())
    assert alone.name == "a"
    raft = plate()
    with pytest.raises(ValueError, match=r"got \['raft'\]. Remedy: \{name: \{case: solution"):
        bodies_of({"raft": raft}, Details(plates={"raft": Plate(1.0, 1.0, 0.2)}))


def test_moments_alone_leave_no_rounding_to_read():
    punch = RigidPunch(SOIL, DualMesh.from_mesh(rectangle(2.0, 1.0, n=50)).basis())
    cases = punch.solve_many({"m": {"force": 0.0, "moments": (1.0, 0.0)}}, unilateral=False)
    assert cases.couple[0] == 0.0
    assert abs(cases.couple[1]) == pytest.approx(1.0)
    assert cases["m"].mean_pressure == 0.0
    assert "Force, acting at  0, at no point" in repr(cases["m"])
    (body,) = bodies_of(cases, Details(allowable=1.0))
    assert body.utilisation[0] == [0.0]


def test_periodic_ground_is_told():
    """As homogeneous, of the modulus of its top layer."""
    side = np.linspace(0.0, 1.0, 9)
    cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    layers = LayeredHalfSpace([Layer(0.3, 1.0, 0.3)], HalfSpace(5.0, 0.2))
    ground = PeriodicGround(layers, (1.0, 1.0))
    found = RigidPunch(ground, cells, gap=lambda x: 0.1 * np.cos(2 * np.pi * x[0])).solve(0.01)
    data = report_data(bodies_of(found, Details()))["substrate"]
    assert (data["kind"], data["period"]) == ("periodic", [1.0, 1.0])
    assert data["ground"]["layers"][0]["thickness"] == 0.3
    text = report_html(found)
    assert "Period after which pressures repeat" in text
    assert "graded half-space" not in text


@pytest.mark.parametrize("cut", [0, 3])
def test_where_a_period_is_cut_turns_nothing_over(cut):
    """Of the same bump, cut elsewhere, the reserve was 1.6 or none."""
    side = np.linspace(0.0, 1.0, 9)
    cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    middle = 0.5 + cut / 8
    punch = RigidPunch(
        PeriodicGround(HalfSpace(1.0, 0.3), (1.0, 1.0)),
        cells,
        gap=lambda x: -0.02 * np.cos(2 * np.pi * (x - middle)).sum(axis=0),
    )
    found = punch.solve(0.1)
    (footing,) = report_data(bodies_of(found, Details(allowable=1.0)))["footings"]
    (case,) = footing["cases"]
    assert case["edge_distance"] is None
    assert case["utilisation"]["overturning"] is None
    text = report_html(found, details=Details(allowable=1.0))
    assert "repeats with the period, and acts in no one point" in text
    assert "Circles stay within one period" in text
    assert "Reserve against overturning" not in text
    two = report_html(punch.solve_many([{"force": 0.1}, {"force": 0.2}]), details=Details())
    assert "Circles stay within one period" in two


def test_unsolved_cases_govern_nothing():
    punch = RigidPunch(SOIL, DualMesh.from_mesh(rectangle(2.0, 1.0, n=50)).basis())
    cases = punch.solve_many({"a": {"force": 1.0}, "b": {"force": 2.0}})
    failed = dataclasses.replace(cases["b"], success=False, message="not found")
    some = dataclasses.replace(cases, solutions=(cases["a"], failed))
    shown = []

    def seen(solution, **_):
        shown.append(solution)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("skfem_dual.visuals.notebook.isobars", seen)
        some._repr_html_()
    assert shown == [cases["a"]]
    none = dataclasses.replace(cases["a"], success=False, message="not found"), failed
    text = report_html(dataclasses.replace(cases, solutions=none))
    assert "which governs" not in text
