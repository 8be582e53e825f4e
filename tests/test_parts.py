"""What bodies are made of, and that nothing keeps it once nobody names it."""

import gc
import warnings
import weakref

import numpy as np
import pytest
from elastic_bodies import raft, uniform
from marks import slow
from plans import disc

from skfem_dual import DualMesh, HalfSpace, Paraboloid, Punches, RigidPunch, RigidPunches
from skfem_dual.contact.parts import Part, by_bodies

UNIT = HalfSpace(1.0, 0.0)


def punch(at=0.0, **options):
    dual = DualMesh.from_mesh(disc(2).translated((at, 0.0)))
    return RigidPunch(UNIT, dual.basis(), origin=(at, 0.0), **options)


def alone():
    body = punch()
    return body, body.solve(1.0, moments=(0.5, 0.0))


def imposed():
    body = punch()
    return body, body.solve(settlement=1.0, tilt=(0.1, 0.0))


def shaped():
    body = punch(gap=Paraboloid(1.0))
    return body, body.solve(0.1)


def many():
    body = punch()
    return body, body.solve_many([{"force": 1.0}, {"force": 1.0, "moments": (0.5, 0.0)}])


def group():
    body = RigidPunches([punch(), punch(3.0), punch(6.0)], joined=[(1, 2)])
    return body, body.solve([{"force": 1.0}] * 2)


def elastic():
    body = raft(1.0)
    return body, body.solve(uniform(body))


def mixed():
    plate = raft(1.0, substrate=UNIT)
    body = Punches([plate, punch(4.0)])
    return body, body.solve([uniform(plate), {"force": 1.0}])


@pytest.mark.parametrize("kind", [alone, many, mixed, *slow(imposed, shaped, group, elastic)])
def test_bodies_are_freed_as_soon_as_nothing_names_them(kind):
    """A matrix may be most of the memory there is: it does not wait for the collector."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of few cells
        kind()  # what is compiled and imported stays
        gc.collect()
        gc.disable()
        try:
            body, solution = kind()
            repr(solution)
            known = weakref.ref(body)
            del body, solution
            assert known() is None
        finally:
            gc.enable()


def test_moments_of_bodies():
    """Of two punches joined, about their common centre."""
    cells = [punch().footprint, punch(3.0).footprint]
    centre = np.array([1.5, 0.5])
    parts = [Part(some, 0, centre) for some in cells]
    joined = by_bodies(parts, [some.resultants for some in cells])
    x = np.hstack([some.acting for some in cells]) - centre[:, None]
    areas = np.concatenate([some.partition.areas for some in cells])
    uniform_pressure = joined @ np.ones(len(areas))
    assert uniform_pressure == pytest.approx([areas.sum(), *(x * areas).sum(axis=1)], rel=1e-12)
