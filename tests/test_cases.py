"""Load cases: the same answers as case by case, whatever they share."""

import csv
import json

import numpy as np
import pytest
from marks import slow
from plans import disc, perturbed, rectangle
from skfem import MeshTri

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    HalfSpace,
    Load,
    Paraboloid,
    ResolutionWarning,
    RigidPunch,
    RigidPunches,
    bearing_pressure,
)
from skfem_dual.grids.generate import polygon
from skfem_dual.grids.generate import rectangle as fine_rectangle
from skfem_dual.io import write_cases
from skfem_dual.report import write_report
from skfem_dual.solutions.bearing import Circles

UNIT = HalfSpace(1.0, 0.0)
FRAME = np.array([[-1.0, 1, 1, -1], [-1, -1, 1, 1]])
RANDOM = np.random.default_rng(3)


def punch(mesh, **options):
    return RigidPunch(UNIT, DualMesh.from_mesh(mesh).basis(), **options)


def same(found, expected):
    assert found.settlement == pytest.approx(expected.settlement, rel=1e-9)
    assert found.tilt == pytest.approx(expected.tilt, rel=1e-9, abs=1e-9)
    scale = expected.pressure.max()
    assert found.pressure == pytest.approx(expected.pressure, abs=1e-8 * scale)
    assert found.gap == pytest.approx(expected.gap, abs=1e-8 * expected.settlement)
    assert found.contact_area == pytest.approx(expected.contact_area, rel=1e-9)
    assert found.success
    assert expected.success


@pytest.mark.parametrize("unilateral", [True, False])
def test_cases_are_the_single_solutions(unilateral):
    """Full contact, some and much of it lost, moments, a position: each as `solve` has it."""
    of = punch(rectangle(14), origin=(0.2, -0.1))
    loads = [
        {"force": float(f), "at": tuple(e)}
        for f, e in zip(
            RANDOM.uniform(0.5, 2, 12), (0.55 * RANDOM.uniform(-1, 1, (12, 2))).tolist()
        )
    ]
    loads += [{"force": 2.0, "moments": (0.3, -0.2)}, {"settlement": 0.1}]
    loads += [Load(force=1.0, tilt=(0.1, 0.0)), {"settlement": 0.2, "tilt": (0.2, 0.1)}]
    cases = of.solve_many(loads, unilateral=unilateral)
    assert cases.success.all()
    assert len({round(float(a), 6) for a in cases.contact_share}) > (7 if unilateral else 0)
    for k, load in enumerate(loads):
        given = load if isinstance(load, dict) else {"force": 1.0, "tilt": (0.1, 0.0)}
        same(cases[k], of.solve(**given, unilateral=unilateral))


def test_contact_that_spreads_without_slopes():
    """Cells that come back into contact bring slopes that were lost without being felt."""
    of = punch(MeshTri.init_tensor(np.linspace(-2, 2, 30), np.linspace(-1, 1, 20)))
    load = {"force": 1.0, "at": (1.1301511916660336, 0.08566928833095575)}
    (found,), expected = of.solve_many([load]).solutions, of.solve(**load)
    same(found, expected)
    assert expected.flat is not None
    assert (found.flat == expected.flat).all()


@pytest.mark.parametrize(
    "options", [{"gap": Paraboloid(1.0)}, {"rtol": 1e-6}, {"symmetry": "auto"}]
)
def test_shaped_punches_fast_operators_and_symmetries(options):
    of = punch(rectangle(12), **options)
    loads = [{"force": f, "at": (e, 0.0)} for f, e in [(0.2, 0.0), (0.3, 0.1), (1.0, 0.55)]]
    cases = of.solve_many(loads)
    for k, load in enumerate(loads):
        # a punch in a group, whose pressures end with the cells as those of cases do
        expected = RigidPunches([of]).solve([load])[0] if of.gap else of.solve(**load)
        assert cases[k].settlement == pytest.approx(expected.settlement, rel=1e-5)
        assert cases[k].pressure == pytest.approx(expected.pressure, abs=1e-4 * expected.force)
    assert cases.success.all()


def test_turning_over_is_a_case_and_no_end():
    of = punch(disc(3), origin=(10.0, 0.0))
    cases = {
        "dead": {"force": 2.0, "at": (-10.0, 0.0)},
        "gale": {"force": 1.0, "at": (-8.5, 0.0)},
        "wind": {"force": 1.0, "at": (-9.5, 0.0)},
    }
    with pytest.warns(ConvergenceWarning, match="1 of 3 load cases .*'gale': .* turns over"):
        found = of.solve_many(cases)
    assert found.success.tolist() == [True, False, True]
    assert np.isnan(found.settlement[1])
    assert np.isnan(found.largest_pressure[1])
    assert found.point[0] == pytest.approx([0.0, 1.5, 0.5])
    assert "2 of 3 found" in repr(found)
    with pytest.raises(ValueError, match="'gale': expected a resultant within the plan"):
        found["gale"]
    with pytest.raises(KeyError, match="the name of a case"):
        found["storm"]
    governs = {e.quantity: (e.name, e.value) for e in found.envelope()}
    assert governs["largest_settlement"][0] == "dead"
    assert governs["contact_share"][0] == governs["slope"][0] == "wind"
    assert governs["contact_share"][1] == found["wind"].contact_area / of.partition.areas.sum()
    areas = [found["dead"].contact_area, np.nan, found["wind"].contact_area]
    np.testing.assert_array_equal(found.contact_area, areas)
    corner = found["dead"].punch_displacement(of.partition.polygons.p).max()
    assert governs["largest_settlement"][1] == pytest.approx(corner, rel=1e-12)


def test_nothing_stands():
    with pytest.warns(ConvergenceWarning, match="1 of 1"):
        cases = punch(disc(2)).solve_many([{"force": 1.0, "at": (3.0, 0.0)}])
    with pytest.raises(ValueError, match="expected a case with a solution"):
        cases.envelope()


@pytest.mark.parametrize(
    ("cases", "error", "message"),
    [
        ([], ValueError, "at least one load case"),
        ([{"force": 1.0}, {"force": "heavy"}], TypeError, "load case '2': .*number"),
        ({"wind": {"at": (0.0, 0.0)}}, ValueError, "load case 'wind': .*force or a settlement"),
        ({"wind": {"load": 1.0}}, TypeError, "keys of load case 'wind'"),
        ({1: {"force": 1.0}}, TypeError, "the name of a load case"),
    ],
)
def test_bad_cases(cases, error, message):
    with pytest.raises(error, match=message):
        punch(disc(2)).solve_many(cases)


def test_neighbours_under_cases():
    mesh = disc(3)
    punches = [
        RigidPunch(UNIT, DualMesh.from_mesh(mesh.translated((x, 0.0))).basis(), origin=(x, 0.0))
        for x in (-1.3, 1.3)
    ]
    group = RigidPunches(punches)
    cases = {
        "both": [{"force": 1.0}, {"force": 2.0}],
        "off": [{"force": 1.0, "at": (0.5, 0.1)}, {"force": 2.0, "at": (0.1, 0.0)}],
    }
    found = group.solve_many(cases)
    assert len(found) == 2
    for name, loads in cases.items():
        expected = group.solve(loads)
        for mine, theirs in zip(found, expected.solutions, strict=True):
            same(mine[name], theirs)
            assert len(mine[name].others) == 1
    with pytest.raises(ValueError, match="2 bodies, got 1 in load case '1'"):
        group.solve_many([[{"force": 1.0}]])


def on_touching_circle(pressure):
    """Mean of a pressure on the circle with a fifth of the radius that touches at (1, 0)."""
    r = 0.2 * np.sqrt((np.arange(1000) + 0.5) / 1000)[:, None]
    angle = 2 * np.pi * (np.arange(400) + 0.5) / 400
    return pressure(0.8 + r * np.cos(angle), r * np.sin(angle)).mean()


@pytest.mark.parametrize("at", [*slow(0.0), 0.3])
def test_bearing_pressure_does_not_depend_on_the_mesh(at):
    """Exact on a disc: ``(1 + 3 e x) / (2 sqrt(1 - r^2))`` of the mean."""
    exact = on_touching_circle(lambda x, y: 0.5 * (1 + 3 * at * x) / np.sqrt(1 - x**2 - y**2))
    errors, largest = [], []
    for n in (2, 3, 4):
        solution = punch(MeshTri.init_circle(n)).solve(np.pi, (at, 0.0))
        errors.append(abs(bearing_pressure(solution) / exact - 1))
        largest.append(solution.pressure.max())
    assert errors[0] < 0.11
    assert errors[1] < 0.35 * errors[0]
    assert errors[2] < 0.45 * errors[1]
    assert largest[-1] > 1.8 * largest[0]  # that of a cell does


def test_bearing_pressure_does_not_depend_on_axes():
    """Points of the circles turn, and turn over, with the plan."""
    at, mesh = np.array([0.3, 0.2]), perturbed(rectangle(6, 1.0, 0.75), 0.03)
    found = []
    for angle, side in [(0.0, 1), (2.0, 1), (0.9, -1)]:
        cos, sin = np.cos(angle), np.sin(angle)
        turn = np.array([[cos, -side * sin], [sin, side * cos]])
        turned = punch(MeshTri(turn @ mesh.p, mesh.t))
        found.append(bearing_pressure(turned.solve(1.0, at=tuple(turn @ at))))
    assert found == pytest.approx([found[0]] * 3, rel=1e-9)


def test_bearing_pressure_of_a_sphere():
    """Hertz: ``3 P / (2 pi a^2)`` in the middle, less on a circle of finite radius."""
    solution = punch(MeshTri.init_circle(4), gap=Paraboloid(1.0)).solve(0.5)
    a = (0.75 * 0.5) ** (1 / 3)
    top = 1.5 * 0.5 / np.pi / a**2
    mean = top * 2 / 3 * (1 - (1 - (0.2 / a) ** 2) ** 1.5) / (0.2 / a) ** 2
    assert bearing_pressure(solution) == pytest.approx(mean, rel=5e-3)


@pytest.mark.parametrize("n", [60, *slow(151, 200)])
def test_circles_are_those_of_the_plan(n):
    """A fifth of the largest one in it, wherever the cells have their centroids."""
    strip = punch(fine_rectangle(10, 1.5, n=n))
    assert Circles.of(strip.footprint).radius == pytest.approx(0.2 * 0.75, rel=1e-9)
    frame = polygon(FRAME, holes=[0.9 * FRAME], n=80)  # centroids at its corners lie outside
    assert Circles.of(punch(frame).footprint).radius == pytest.approx(
        0.2 * 0.1 * (2 - 2**0.5), rel=1e-6
    )


def test_bearing_pressure_of_contact_narrower_than_a_circle():
    """A base that nearly tips stands on a strip, whose pressure no wider circle has."""
    cases = punch(rectangle(6)).solve_many(
        {"tipping": {"force": 1.0, "at": (0.93, 0.0)}, "tame": {"force": 1.0, "at": (0.5, 0.0)}}
    )
    tipping, tame = cases
    assert bearing_pressure(tipping) == tipping.mean_pressure > 2 * bearing_pressure(tame)
    assert bearing_pressure(tame) > tame.mean_pressure
    assert cases.envelope()[0].name == "tipping"


def test_bearing_pressure_of_shaped_punches_pressed_to_the_edge(tmp_path):
    """Each case by its own law of the edge, as alone; reports say which."""
    shaped = punch(disc(2), gap=Paraboloid(50.0))
    cases = shaped.solve_many([{"force": 10.0}, {"force": 0.01}])
    for pressure, force, edge in zip(
        cases.largest_pressure, (10.0, 0.01), ("singular", "constant"), strict=True
    ):
        alone = shaped.solve(force)
        assert pressure == pytest.approx(bearing_pressure(alone), rel=1e-9)
        write_report(tmp_path / "alone.json", alone)
        assert json.loads((tmp_path / "alone.json").read_text())["footings"][0]["edge"] == edge
    write_report(tmp_path / "cases.json", cases)
    (told,) = json.loads((tmp_path / "cases.json").read_text())["footings"]
    assert told["edge"] == "singular"
    assert told["cases"][0]["pressure"]["largest"] == pytest.approx(cases.largest_pressure[0])


def test_table(tmp_path):
    cases = punch(disc(3)).solve_many(
        {"dead, live": {"force": 2.0}, "wind": {"force": 1, "at": (0.1, 0)}}
    )
    path = tmp_path / "out.csv"
    cases.write(path)
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == ["dead, live", "wind"]
    for row, expected in zip(rows, cases.table(), strict=True):
        assert float(row["settlement"]) == expected["settlement"]
        assert row["success"] == "True"
    assert [p.name for p in tmp_path.iterdir()] == ["out.csv"]
    with pytest.raises(FileNotFoundError):
        cases.write(tmp_path / "no" / "out.csv")
    with pytest.raises(TypeError, match="str or PathLike for path, got None"):
        cases.write(None)


def test_tables_keep_all_of_a_load():
    """Of moments alone nothing was told, and horizontal forces by what they move."""
    cases = punch(disc(2)).solve_many(
        {
            "couple": {"force": 0.0, "moments": (-5.0, 10.0)},
            "pushed": {"force": 1.0, "horizontal": (0.3, -0.2), "torsion": 0.1},
            "still": {"force": 1.0, "at": (0.1, 0.0)},
        },
        unilateral=False,
    )
    couple, pushed, still = cases.table()
    assert [couple["mx"], couple["my"]] == pytest.approx([10.0, 5.0], rel=1e-9)
    assert [couple["hx"], couple["torsion"], pushed["mx"], still["my"]] == [0.0] * 4
    assert [pushed[name] for name in ("hx", "hy", "torsion")] == [0.3, -0.2, 0.1]
    assert pushed["ux"] > 0 > pushed["uy"]
    (alone,) = punch(disc(1)).solve_many([{"force": 1.0}]).table()
    assert not {"mx", "hx"} & set(alone)


def test_tables_of_several_footings(tmp_path):
    """Columns of one table are there for all."""
    still = punch(disc(1)).solve_many([Load(force=1.0)])
    pushed = punch(disc(1)).solve_many([Load(force=2.0, horizontal=(0.5, 0.0))])
    write_cases(path := tmp_path / "out.csv", still, pushed, footings=("Süd", "Łąka"))
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["footing"], row["force"], bool(row["ux"])) for row in rows] == [
        ("Süd", "1.0", False),
        ("Łąka", "2.0", True),
    ]
    for tables, names, error in (
        ((), (), ValueError),
        ((still,), ("a", "b"), ValueError),
        ((still.table(),), (), TypeError),
    ):
        with pytest.raises(error, match="expected"):
            write_cases(path, *tables, footings=names)


@pytest.mark.slow
@pytest.mark.parametrize("lifting", [0, 500])
def test_a_thousand_cases(lifting):
    """With 600 cells, those that lift off far from each other and close together."""
    of = punch(MeshTri.init_tensor(np.linspace(-2, 2, 30), np.linspace(-1, 1, 20)))
    e = RANDOM.uniform(-0.12, 0.12, (1000, 2)) * [2, 1]
    angle = RANDOM.uniform(0, 2 * np.pi, lifting)
    far = RANDOM.uniform(0.5, 0.85, lifting)  # of the way to the edge, along rays
    e[:lifting] = (far * np.array([2 * np.cos(angle), np.sin(angle)])).T * 0.75
    cases = of.solve_many([{"force": 1.0, "at": tuple(x)} for x in e.tolist()])
    rows = cases.table()
    assert cases.success.all()
    for k in range(0, lifting, 50):
        expected = of.solve(1.0, at=tuple(e[k].tolist()))
        same(cases[k], expected)
        assert rows[k]["largest_pressure"] == pytest.approx(bearing_pressure(expected), rel=1e-9)
    assert (cases.contact_share < 1 - 1e-9).sum() == pytest.approx(lifting, abs=0.2 * lifting)


def test_a_case_on_which_nothing_slides_stops_no_others():
    """Its table, file and report ended in the error of a single solution."""
    punch = RigidPunch(HalfSpace(30e6, 0.3), DualMesh.from_mesh(disc(3)).basis())
    up = {"settlement": -1e-3, "horizontal": (1e4, 0.0)}
    with pytest.raises(ValueError, match="contact on two cells or more"):
        punch.solve(**up)
    with pytest.warns(ConvergenceWarning, match="two cells or more"):
        cases = punch.solve_many({"up": up, "ok": {"force": 1e6, "horizontal": (1e4, 0.0)}})
    assert cases.success.tolist() == [False, True]
    assert "contact on two cells or more" in cases.messages[0]
    assert np.isnan(cases.sliding[:, 0]).all()
    assert cases.sliding[0, 1] > 0
    assert [row["success"] for row in cases.table()] == [False, True]


def test_a_body_of_a_group_on_which_nothing_slides_stops_no_other_case():
    mesh = disc(3)
    cells = DualMesh.from_mesh(mesh).basis()
    middle = tuple(cells.partition.centroids[:, 0])
    ball = RigidPunch(UNIT, cells, gap=Paraboloid(1e-3, middle), origin=middle)
    flat = punch(mesh.translated((3.0, 0.0)), origin=(3.0, 0.0))
    group = RigidPunches([ball, flat])
    with pytest.warns((ConvergenceWarning, ResolutionWarning)):
        both = group.solve_many(
            {
                "a": ({"force": 1e-9, "horizontal": (0, 0)}, {"force": 1.0}),
                "b": ({"force": 500.0}, {"force": 1.0}),
            }
        )
    assert both[0].success.tolist() == [False, True]
    assert [row["success"] for row in both[0].table()] == [False, True]


def test_cases_by_number_and_places_of_reactions():
    loads = [{"settlement": 0.01, "at": (0.1, 0.0)}, {"settlement": 0.01, "at": (9.0, 0.0)}]
    with pytest.warns(ConvergenceWarning, match="1 of 2 load cases without a solution"):
        cases = punch(disc(2)).solve_many(loads)
    assert cases.success.tolist() == [True, False]
    assert cases.point == pytest.approx(np.array([[0.1, 9.0], [0.0, 0.0]]))
    with pytest.raises(IndexError, match="expected a case from 0 to 1, got 2"):
        cases[2]
    nothing = punch(disc(2)).solve_many([{"settlement": -0.01}, {"settlement": 0.01}])
    assert np.isnan(nothing.point).tolist() == [[True, False]] * 2
