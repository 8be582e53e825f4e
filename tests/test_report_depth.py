"""What reports tell of the ground below footings."""

import json

import numpy as np
import pytest
from marks import slow

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    RigidPunch,
    stress_below,
)
from skfem_dual.cli import main
from skfem_dual.grids.generate import rectangle
from skfem_dual.report import report_html
from skfem_dual.report.depth import below
from skfem_dual.report.details import Details

pytestmark = pytest.mark.usefixtures("undrawn")
BASIS = DualMesh.from_mesh(rectangle(4.0, 3.0, n=60)).basis()
LAYERS = [Layer(1.0, 20e3, 0.3), Layer(2.0, 5e3, 0.4)]


@pytest.mark.parametrize(
    "ground",
    [
        HalfSpace(20e3, 0.3),
        *slow(GradedHalfSpace.init_linear(20e3, 0.3, 0.5)),
        LayeredHalfSpace(LAYERS, HalfSpace(50e3, 0.3)),
        *slow(LayeredHalfSpace(LAYERS, "bonded")),
    ],
    ids=["homogeneous", "graded", "layers", "rock"],
)
def test_every_ground(ground):
    solution = RigidPunch(ground, BASIS).solve(1e3)
    details = Details(profile=(0.5, 0.2), units="kN,m")
    found = below(solution, details.profile)
    moved = solution.ground_displacement([[0.5], [0.2]])[0]
    assert found.parts.sum() == pytest.approx(moved, rel=1e-9)
    depth = found.profile.depth
    assert depth[-1] == min(12.0, ground.strata.interfaces[-1])
    points = np.vstack([np.full(len(depth), 0.5), np.full(len(depth), 0.2), depth])
    expected = stress_below(solution, points).sigma_z
    assert found.profile.stresses.sigma_z == pytest.approx(expected)
    if len(ground.strata.layers) > 2:
        page = report_html(solution, details=details)
        assert "Stress with depth" in page
        assert "What the ground contributes" in page


def test_horizontal_loads_are_not_in_it():
    punch, details = RigidPunch(HalfSpace(20e3, 0.3), BASIS), Details(profile=(0, 0))
    assert "own weight, in the case" in report_html(punch.solve(1e3), details=details)
    page = report_html(punch.solve(1e3, horizontal=(100.0, 0.0)), details=details)
    assert "own weight and the horizontal load, in the case" in page


@pytest.mark.parametrize(
    ("base", "last"), [("bonded", "1 – 3"), (HalfSpace(5e4, 0.3), "below 3")], ids=["rock", "soil"]
)
def test_the_last_layer_ends_at_rock(base, last):
    solution = RigidPunch(LayeredHalfSpace(LAYERS, base), BASIS).solve(1e3)
    page = report_html(solution, units="kN,m")
    shares = page[page.index("What the ground contributes") :].partition("</table>")[0]
    assert last in shares.split("<tr>")[-1]


def test_of_the_command_line(tmp_path):
    file = tmp_path / "out.json"
    options = "--young 2e4 --poisson 0.3 --force 1e3 --profile 0.75 0 --quiet --json"
    mesh = "tests/data/excised_square.msh"
    assert main(["solve", mesh, *options.split(), str(file)]) == 0
    (footing,) = json.loads(file.read_text())["footings"]
    told = footing["stress_profile"]
    assert told["point"] == [0.75, 0.0]
    assert len(told["depth"]) == len(told["stress"]) == len(told["strain"])
    assert sum(told["parts"]["shortening"]) == pytest.approx(
        footing["cases"][0]["settlement"], rel=0.01
    )
