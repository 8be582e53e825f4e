"""Where warnings point to, and which are told."""

import warnings

import pytest
from skfem import MeshTri

from skfem_dual import (
    DualMesh,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    ResolutionWarning,
    RigidPunch,
    RigidPunches,
    Sphere,
    load_path,
    moment_rotation,
    refine_to_contact,
)

MESH = MeshTri.init_circle(2)
SOIL = HalfSpace(1.0, 0.3)
THIN = LayeredHalfSpace([Layer(0.01, 1.0, 0.49)], "bonded")


def on(mesh=MESH, gap=None, ground=SOIL, origin=(0.0, 0.0)):
    return RigidPunch(ground, DualMesh.from_mesh(mesh).basis(), gap=gap, origin=origin)


def group():
    """A flat punch with contact everywhere beside a sphere on few cells."""
    far = (3.0, 0.0)
    return RigidPunches([on(), on(MESH.translated(far), Sphere(5.0, far), origin=far)])


LOADS = [{"force": 1.0}, {"force": 1e-3}]


@pytest.mark.parametrize(
    "call",
    [
        lambda: on(gap=Sphere(5.0)).solve(1e-3),
        lambda: on(gap=Sphere(5.0)).solve_many([{"force": 1e-3}]),
        lambda: load_path(on(gap=Sphere(5.0)), [{"force": 1e-3}]),
        lambda: moment_rotation(on(), 1.0, steps=5),
        lambda: refine_to_contact(lambda mesh: on(mesh, Sphere(5.0)), MESH, {"force": 1e-3}, 0),
        lambda: group().solve(LOADS),
        lambda: group().solve_many([LOADS]),
        lambda: on(ground=THIN),
    ],
)
def test_warnings_point_to_who_called_the_package(call):
    with pytest.warns(ResolutionWarning) as told:
        call()
    assert {warning.filename for warning in told} == {__file__}


def test_what_was_told_of_a_solution_is_not_told_of_its_bounds():
    with pytest.warns(ResolutionWarning, match="contact on 5 of 41 cells"):
        solution = on(gap=Sphere(5.0)).solve(1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert solution.bounds.settlement[0] < solution.settlement < solution.bounds.settlement[1]
