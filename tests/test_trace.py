import numpy as np
import pytest
from skfem import MeshHex, MeshTet, MeshTri

from skfem_dual import DualMesh, trace

SOLIDS = [MeshTet().refined(2), MeshHex().refined(2)]


def tagged(solid):
    return solid.with_boundaries(
        {
            "base": lambda x: x[2] == 0,
            "left": lambda x: x[0] == 0,
            "top": lambda x: x[2] == 1,
            "pad": lambda x: (x[2] == 0) & (x[0] < 0.5),
        }
    )


@pytest.mark.parametrize("solid", SOLIDS)
def test_plan_has_the_area_and_the_tags_of_the_base(solid):
    plan = trace(tagged(solid), "base")
    assert plan.p.shape[0] == 2
    assert set(plan.boundaries) == {"left"}
    assert (plan.p[0, plan.facets[:, plan.boundaries["left"]]] == 0).all()
    assert len(plan.boundaries["left"]) == 4
    assert set(plan.subdomains) == {"pad"}
    assert (plan.p[0, plan.t[:, plan.subdomains["pad"]]].mean(axis=0) < 0.5).all()
    assert len(plan.subdomains["pad"]) == plan.nelements / 2


@pytest.mark.parametrize("solid", SOLIDS)
def test_cells_are_in_the_subdomains_of_the_elements_above(solid):
    parts = {"pier": lambda x: x[0] < 0.5, "all": lambda x: x[0] < 2, "cap": lambda x: x[2] > 0.5}
    plan = trace(tagged(solid).with_subdomains(parts), "base")
    assert set(plan.subdomains) == {"pier", "all", "pad"}
    middle = plan.p[0, plan.t].mean(axis=0)
    assert (middle[plan.subdomains["all"]] > 0.5).any()
    assert len(plan.subdomains["all"]) == plan.nelements
    assert 0 < len(plan.subdomains["pier"]) < plan.nelements


def test_plan_has_a_dual_grid():
    plan = trace(tagged(SOLIDS[0]).translated((2.0, 3.0, -1.0)), "base")
    assert isinstance(plan, MeshTri)
    assert DualMesh.from_mesh(plan).areas.sum() == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("solid", SOLIDS)
def test_any_form_of_facets(solid):
    by_name = trace(tagged(solid), "base")
    by_number = trace(solid, solid.facets_satisfying(lambda x: x[2] == 0))
    by_function = trace(solid, lambda x: x[2] == 0)
    for plan in (by_number, by_function):
        np.testing.assert_array_equal(plan.p, by_name.p)
        np.testing.assert_array_equal(plan.t, by_name.t)


def test_refused():
    solid = tagged(SOLIDS[0])
    with pytest.raises(TypeError, match="MeshTet or MeshHex, got MeshTri"):
        trace(MeshTri(), "base")
    with pytest.raises(ValueError, match=r"\['base', 'left', 'pad', 'top'\], got 'bottom'"):
        trace(solid, "bottom")
    with pytest.raises(ValueError, match="one plane z = const"):
        trace(solid, "left")
    for nothing in (np.array([], dtype=int), [], ()):
        with pytest.raises(ValueError, match="got none"):
            trace(solid, nothing)
    for unknown in (["base", "bottom"], 2.5, {}, b"base", solid, [[]]):
        with pytest.raises(ValueError, match=r"a boundary by its name, one of \['base'.*, got"):
            trace(solid, unknown)
    with pytest.raises(ValueError, match=r"values of boundary\(x\), one for each facet, got"):
        trace(solid, lambda x: True)
