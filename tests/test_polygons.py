import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from skfem_dual import MeshError
from skfem_dual.grids.polygons import Polygons

L_SHAPE = np.array([[0, 2, 2, 1, 1, 0], [0, 0, 1, 1, 2, 2.0]])


def test_area_and_centroid_of_a_concave_polygon():
    polygons = Polygons(L_SHAPE, np.arange(6), [0, 6])
    assert polygons.areas == pytest.approx([3.0])
    assert polygons.centroids[:, 0] == pytest.approx([5 / 6, 5 / 6])
    assert np.array_equal(polygons[0], L_SHAPE)
    assert np.array_equal(polygons[-len(polygons)], L_SHAPE)
    with pytest.raises(IndexError, match="expected a polygon from 0 to "):
        polygons[len(polygons)]


@given(
    arrays(float, (2, 3), elements=st.floats(-1, 1)),
    st.floats(-1e6, 1e6),
    st.floats(1e-3, 1e3),
)
def test_moments_move_and_scale_with_the_polygon(triangle, shift, factor):
    a, b = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    area = (a[0] * b[1] - a[1] * b[0]) / 2
    assume(abs(area) >= 1e-3)
    polygons = Polygons.from_cells(triangle, np.array([[0], [1], [2]]))
    moved = Polygons.from_cells(triangle * factor + shift, np.array([[2], [1], [0]]))
    tolerance = 1e-9 * (factor + abs(shift))
    assert polygons.areas[0] == pytest.approx(abs(area))
    assert moved.areas[0] == pytest.approx(abs(area) * factor**2, abs=tolerance * factor)
    assert moved.centroids == pytest.approx(
        triangle.mean(axis=1, keepdims=True) * factor + shift, abs=tolerance
    )


def test_radii_are_distances_of_the_farthest_vertices():
    two = Polygons([[0, 4, 4, 0, 9], [0, 0, 3, 3, 0]], [0, 1, 2, 3, 1, 4, 2], [0, 4, 7])
    far = [np.hypot(*(two[i] - two.centroids[:, i : i + 1])).max() for i in range(2)]
    assert two.radii == pytest.approx(far, rel=1e-14)
    assert two.radii[0] == pytest.approx(2.5, rel=1e-14)
    assert not two.radii.flags.writeable


def test_second_moments_about_the_centroid():
    """Rectangle b h^3 / 12, the L by the theorem of parallel axes, both far from the origin."""
    p = np.hstack([[[0.0, 3, 3, 0], [0.0, 0, 2, 2]], L_SHAPE])
    for shift in (0.0, 1e3):
        polygons = Polygons(p + shift, np.arange(10), [0, 4, 10])
        (xx, xy, yy), tolerance = polygons.second_moments, 1e-9 * (1 + shift)
        assert [xx[0], xy[0], yy[0]] == pytest.approx([4.5, 0, 2], abs=tolerance)
        # 2 x 1 below, 1 x 1 above: seen from the corner, less the area times the centroid's
        assert xx[1] == pytest.approx(8 / 3 + 1 / 3 - 3 * (5 / 6) ** 2, abs=tolerance)
        assert xy[1] == pytest.approx(1 + 0.75 - 3 * (5 / 6) ** 2, abs=tolerance)
        assert yy[1] == pytest.approx(2 / 3 + 7 / 3 - 3 * (5 / 6) ** 2, abs=tolerance)
        assert not polygons.second_moments.flags.writeable


def test_one_bad_polygon_among_others():
    p = np.array([[0.0, 1, 1, 0], [0.0, 0, 1, 1]])
    for bad, message in (
        ([2, 1, 0], "counter-clockwise.* polygons 1 are"),
        ([0, 2], "polygons 1"),
    ):
        indices = np.array([0, 1, 2, *bad, 0, 2, 3])
        ends = np.cumsum([0, 3, len(bad), 3])
        with pytest.raises(MeshError, match=message):
            Polygons(p, indices, ends)


def test_arrays_are_copied_and_cannot_be_changed():
    p = L_SHAPE.copy()
    polygons = Polygons(p, np.arange(6), [0, 6])
    p[0, 0] = 9.0
    assert polygons.p[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        polygons.p[0, 0] = 1.0


@pytest.mark.parametrize(
    ("p", "indices", "offsets", "message"),
    [
        (L_SHAPE.T, np.arange(6), [0, 6], r"shape \(2, n\)"),
        (L_SHAPE, np.arange(6), [0, 5], "offsets"),
        (L_SHAPE, np.arange(6), [0], "offsets"),
        (L_SHAPE, [0, 1, 2, 3, 4], [0, 3, 5], "three vertices.* polygons 1"),
        (L_SHAPE, [0, 1, 6], [0, 3], "indices from 0 to 5"),
        (L_SHAPE, np.arange(6)[::-1], [0, 6], "counter-clockwise.* polygons 0"),
        (L_SHAPE * np.nan, np.arange(6), [0, 6], "finite"),
    ],
)
def test_bad_arrays_are_refused(p, indices, offsets, message):
    with pytest.raises(MeshError, match=message):
        Polygons(p, indices, offsets)
