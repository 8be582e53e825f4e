import pickle

import numpy as np
import pytest
from scipy import interpolate
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import HalfSpace, MeasuredProfile, RigidPunch

X = np.random.default_rng(0).uniform(-1, 1, (2, 50))


def test_measured_profile():
    """Linear between the points: exact for a plane."""
    nodes = np.random.default_rng(1).uniform(-2, 2, (2, 200))
    shape = MeasuredProfile(nodes, 1 + 2 * nodes[0] - nodes[1])
    assert shape(X) == pytest.approx(1 + 2 * X[0] - X[1])
    with pytest.raises(ValueError, match=r"outside them"):
        shape([[3.0], [0.0]])


AXES = np.array([-1.2, -0.3, 0.1, 1.4]), np.array([-1.0, 0.0, 0.5, 1.0, 1.6])


def test_a_grid_of_heights_is_bilinear():
    """Exact for a + bx + cy + dxy, by axes and by points in any order; on the rim as well."""
    x, y = np.meshgrid(*AXES, indexing="ij")
    heights = 1 + 2 * x - y + 3 * x * y
    order = np.random.default_rng(0).permutation(x.size)
    points = np.stack([x.ravel(), y.ravel()])[:, order]
    expected = 1 + 2 * X[0] - X[1] + 3 * X[0] * X[1]
    for shape in (MeasuredProfile(AXES, heights), MeasuredProfile(points, heights.ravel()[order])):
        assert shape(X) == pytest.approx(expected, abs=1e-14)
        assert shape(X.reshape(2, 5, 10)) == pytest.approx(expected.reshape(5, 10), abs=1e-14)
        assert float(shape([1.4 + 1e-13, -1.0 - 1e-13])) == pytest.approx(0.6, abs=1e-10)
        assert pickle.loads(pickle.dumps(shape))(X) == pytest.approx(expected, abs=1e-14)
        with pytest.raises(ValueError, match=r"\(1.5, 0\) is outside them"):
            shape([[0.0, 1.5], [0.0, 0.0]])


@pytest.mark.parametrize("angle", [0, 90, 180, 270])
@pytest.mark.parametrize("middle", [0.0, 1e7])
def test_a_turned_grid_is_a_grid(angle, middle):
    """Turned by rounding, too: one of triangles had other heights."""
    x, y = np.meshgrid(*AXES, indexing="ij")
    cos, sin = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    turn = np.array([[cos, -sin], [sin, cos]])
    heights = np.random.default_rng(0).random(x.size)
    places = turn @ np.stack([x.ravel(), y.ravel()]) + middle
    found = MeasuredProfile(places, heights)(turn @ X + middle)
    expected = MeasuredProfile(AXES, heights.reshape(x.shape))(X)
    assert found == pytest.approx(expected, abs=1e-12 + 1e-15 * middle * 20)
    MeasuredProfile(places, heights, in_middles=True)


def test_scattered_points_are_triangulated_once(monkeypatch):
    made = []
    triangulated = interpolate.LinearNDInterpolator
    monkeypatch.setattr(
        interpolate, "LinearNDInterpolator", lambda *a: made.append(1) or triangulated(*a)
    )
    shape = MeasuredProfile(X, X[0])
    middle = X[:, :3].mean(axis=1)
    assert [float(shape(middle)) for _ in range(3)] == pytest.approx([middle[0]] * 3)
    assert len(made) == 1


@pytest.mark.parametrize("at", [(0.0, 0.0), (5e5, 5.6e6)])
def test_scattered_points_at_site_coordinates(at):
    """Circles around triangles had no digits left there; the rim of turned points is on it."""
    at, turned = np.reshape(at, (2, 1)), np.array([[0.8, -0.6], [0.6, 0.8]])
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 21)] * 2)).reshape(2, -1)
    shape = MeasuredProfile(turned @ grid + at, np.sum(grid**2, axis=0))
    x = np.hstack([grid, np.random.default_rng(0).uniform(-1, 1, (2, 200))])
    assert np.abs(shape(turned @ x + at) - np.sum(x**2, axis=0)).max() < 0.0051
    with pytest.raises(ValueError, match="is outside them"):
        shape(turned @ [[1.001], [0.0]] + at)


def test_heights_in_the_middles_of_rectangles(tmp_path):
    """As of pixels: the plan may be all of them, as the cells of a finer or dual grid are."""
    x, y = 0.1 * np.arange(10) + 2.05, 0.2 * np.arange(5) - 0.9
    heights = 1 + 2 * x[:, None] - 3 * y + x[:, None] * y
    np.save(tmp_path / "a.npy", heights)
    shape = MeasuredProfile.read(tmp_path / "a.npy", (0.1, 0.2), (2.0, -1.0), peaks=False)
    ends = np.array([[2.0, 3.0, 3.0, 2.0, 2.5], [-1.0, -1.0, 0.0, 0.0, 0.0]])
    expected = 1 + 2 * ends[0] - 3 * ends[1] + ends[0] * ends[1]
    for each in (shape, pickle.loads(pickle.dumps(shape))):
        assert each(ends) == pytest.approx(expected, rel=1e-12)
        with pytest.raises(ValueError, match="is outside them"):
            each([3.01, -0.5])
    with pytest.raises(ValueError, match="is outside them"):
        MeasuredProfile((x, y), heights)(ends)
    with pytest.raises(ValueError, match="on a grid with in_middles=True, got scattered ones"):
        MeasuredProfile(X, X[0], in_middles=True)


def test_points_measured_twice_have_one_height():
    twice = np.hstack([X, X[:, :7]])
    assert MeasuredProfile(twice, twice[0])(X) == pytest.approx(X[0])


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (
            lambda: MeasuredProfile(np.zeros((2, 2)), [0, 0]),
            ValueError,
            "x with at least 3 items, got 2",
        ),
        (lambda: MeasuredProfile(X, [[1], [2, 3]]), TypeError, "height as an array of numbers"),
        (lambda: MeasuredProfile(X, [0.0]), ValueError, r"height of shape \(50,\), got \(1,\)"),
        (
            lambda: MeasuredProfile(
                [[0, 1, 0, 1, 0.5, 0.5], [0, 0, 1, 1, 0.5, 0.5]], [0] * 5 + [9]
            ),
            ValueError,
            r"one height at each point, got 0 and 9 at \(0.5, 0.5\), points 4 and 5",
        ),
        (
            lambda: MeasuredProfile(4e6 + np.array([[1.0], [2.0]]) * X[0], X[0]),
            ValueError,
            r"got all on a line from \(3999999.005, 3999998.011\) to",
        ),
        (
            lambda: MeasuredProfile([[1, 1, 1], [2, 2, 2]], [0, 0, 0]),
            ValueError,
            r"all on a line from \(1, 2\) to \(1, 2\). Remedy: for a shape",
        ),
        (lambda: MeasuredProfile(X, np.zeros((5, 10))), TypeError, "coordinates of a grid"),
        (
            lambda: MeasuredProfile(AXES, np.zeros((5, 4))),
            ValueError,
            r"height of shape \(4, 5\), got \(5, 4\). Remedy: transpose",
        ),
        (
            lambda: MeasuredProfile((AXES[0], AXES[1][::-1]), np.zeros((4, 5))),
            ValueError,
            r"ascending coordinates x\[1\] of a grid, got 1 after 1.6 at index 1",
        ),
        (
            lambda: MeasuredProfile(X, np.full(50, np.nan)),
            ValueError,
            "finite height, got nan at index 0",
        ),
    ],
)
def test_bad_profiles(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_heights_in_memory_are_those_of_a_file(tmp_path):
    """The highest point touches first."""
    heights = np.random.default_rng(0).uniform(size=(4, 5))
    np.save(tmp_path / "z.npy", heights)
    options = {"spacing": (0.5, 0.25), "origin": (1.0, -2.0)}
    x = np.vstack([[1.25, 2.0, 2.75], [-1.9, -1.5, -0.8]])
    for peaks in (True, False):
        found = MeasuredProfile.from_heights(heights.tolist(), **options, peaks=peaks)
        read = MeasuredProfile.read(tmp_path / "z.npy", **options, peaks=peaks)
        assert found(x).tolist() == read(x).tolist()
    i, j = np.unravel_index(heights.argmax(), heights.shape)
    top = MeasuredProfile.from_heights(heights, 1.0)
    assert top([[i + 0.5], [j + 0.5]]) == pytest.approx(0.0, abs=1e-15)
    with pytest.raises(ValueError, match="two heights or more"):
        MeasuredProfile.from_heights([[1.0, 2.0]], 1.0)
    with pytest.raises(ValueError, match="positive distances for spacing"):
        MeasuredProfile.from_heights(heights, 0.0)
    cells = CellBasis(MeshQuad.init_tensor(np.arange(5.0), np.arange(6.0)), ElementQuad0())
    with pytest.raises(ValueError, match=r"shape \(4, 5\). Remedy: MeasuredProfile.from_heights"):
        RigidPunch(HalfSpace(1.0, 0.0), cells, gap=heights, origin=(2, 2.5)).solve(1.0)


@pytest.mark.parametrize("scattered", [False, True])
@pytest.mark.parametrize("at", [0.0, 1e6])
def test_the_last_digit_beyond_the_rim_is_on_it(scattered, at):
    """On all four sides, of a grid and of scattered points."""
    corners = np.array([[-1.0, -1.0, 1.0, 1.0], [-1.0, 1.0, -1.0, 1.0]])
    points = np.hstack([corners, X]) if scattered else corners
    shape = MeasuredProfile(points + at, points[0])
    rim = np.array([[-1.0, 1.0, 0.2, 0.2], [0.3, 0.3, -1.0, 1.0]])
    beyond = np.nextafter(rim + at, rim * np.inf) if at else rim * (1 + 1e-15)
    assert shape(beyond) == pytest.approx(rim[0], abs=1e-8)


@pytest.mark.parametrize(("size", "at", "off"), [(0.01, 1e7, 2e-9), (1.0, 0.0, 1e-10)])
def test_grids_of_rounded_coordinates_are_grids(size, at, off):
    """Small far away, or written with ten digits: heights are bilinear between them."""
    x, y = np.meshgrid(*AXES, indexing="ij")
    places = size * np.stack([x.ravel(), y.ravel()]) + at
    places += off * np.random.default_rng(0).integers(0, 2, places.shape)
    shape = MeasuredProfile(places, (x * y).ravel(), in_middles=True)
    assert shape(size * X + at) == pytest.approx(X[0] * X[1], abs=10 * off / size)


@pytest.mark.parametrize(
    "text",
    [
        "1.5;2;3;\n4;5;6;\n",
        "1,5;2;3;\n4;5;6;\n",
        "1.5\t2\t3\t\n4\t5\t6\t\n",
        "1.5,2,3,,\n4,5,6,,\n",
    ],
)
def test_lines_that_end_with_a_mark(tmp_path, text):
    """As instruments write them: a column of nothing was no number."""
    path = tmp_path / "h.csv"
    path.write_text(text)
    profile = MeasuredProfile.read(path, spacing=(1.0, 1.0))
    plain = MeasuredProfile.from_heights(np.array([[1.5, 2, 3], [4, 5, 6]]), spacing=(1.0, 1.0))
    x = np.array([[0.5, 1.5, 1.0], [0.5, 1.5, 1.2]])
    assert profile(x) == pytest.approx(plain(x))


def test_the_typographic_minus_of_heights(tmp_path):
    path = tmp_path / "h.csv"
    path.write_text("\N{MINUS SIGN}1.5,2\n4,5\n")
    profile = MeasuredProfile.read(path, spacing=(1.0, 1.0))
    plain = MeasuredProfile.from_heights(np.array([[-1.5, 2.0], [4.0, 5.0]]), spacing=(1.0, 1.0))
    x = np.array([[0.6], [0.9]])
    assert profile(x) == pytest.approx(plain(x))


@pytest.mark.parametrize("heads", ["x [mm];y [mm];z [um]", "a [nm];b [nm];c"])
def test_columns_that_are_no_grid_of_heights(tmp_path, heads):
    """They were taken for one, some in another unit than others."""
    path = tmp_path / "p.csv"
    path.write_text(heads + "\n0;0;1\n1;0;2\n0;1;3\n1;1;4\n")
    with pytest.raises(
        ValueError, match=r"a grid of heights in one unit .*, got columns .* Remedy"
    ):
        MeasuredProfile.read(path, spacing=0.1)
