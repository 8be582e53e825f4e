"""Heights of measured surfaces from files."""

import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from skfem_dual import MeasuredProfile

HEIGHTS = np.arange(12.0).reshape(3, 4) ** 1.5
SCALE = {"m": 1.0, "mm": 1e-3, "\u00b5m": 1e-6}
SPACING, ORIGIN = (0.5, 0.25), (-1.0, 2.0)


def points():
    x, y = -1 + 0.5 * (np.arange(3) + 0.5), 2 + 0.25 * (np.arange(4) + 0.5)
    return np.stack(np.meshgrid(x, y, indexing="ij"))


def check(profile, heights=HEIGHTS):
    assert profile(points()) == pytest.approx(heights.max() - heights, abs=1e-12)


@pytest.mark.parametrize("dtype", [float, np.float32, int])
def test_array(tmp_path, dtype):
    file = tmp_path / "heights.npy"
    np.save(file, HEIGHTS.astype(dtype))
    check(MeasuredProfile.read(file, SPACING, ORIGIN), HEIGHTS.astype(dtype).astype(float))
    gap = MeasuredProfile.read(file, SPACING, ORIGIN, peaks=False)
    assert gap(points()) == pytest.approx(HEIGHTS.astype(dtype))


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
@pytest.mark.parametrize("header", ["", "x{0}y{0}height\n"])
def test_text(tmp_path, separator, header):
    """A grid of heights, or points with heights in any order."""
    grid, scattered = tmp_path / "grid.csv", tmp_path / "points.txt"
    np.savetxt(grid, HEIGHTS, delimiter=separator)
    check(MeasuredProfile.read(str(grid), SPACING, ORIGIN))
    rows = np.vstack([points().reshape(2, -1), HEIGHTS.ravel()]).T
    rows = np.random.default_rng(0).permutation(rows)
    np.savetxt(scattered, rows, delimiter=separator, header=header.format(separator), comments="")
    check(MeasuredProfile.read(scattered))
    scattered.write_text("\ufeff" + scattered.read_text())  # as Windows marks its texts
    check(MeasuredProfile.read(scattered))


@pytest.mark.parametrize(
    ("header", "order", "sizes"),
    [
        ("y,x,z", [1, 0, 2], (None, None, None)),
        ("height [um];Easting [m];Northing / cm", [2, 0, 1], (1e-6, 1.0, 1e-2)),
        ("x [mm] y [mm] z [nm]", [0, 1, 2], (1e-3, 1e-3, 1e-9)),
        ("x,z [mm],y", [0, 2, 1], (None, 1e-3, None)),
        ("a,b,c [\u03bcm]", [0, 1, 2], (None, None, 1e-6)),
    ],
)
@pytest.mark.parametrize(("unit", "own"), [("m", 1.0), ("um", 1e-6)])
def test_headings_tell_columns_and_units(tmp_path, header, order, sizes, unit, own):
    """They were left out unread: x for y, and micrometres for millimetres."""
    rows = np.vstack([points().reshape(2, -1), HEIGHTS.ravel()]).T[:, order]
    written = rows * [1.0 if size is None else own / size for size in sizes]
    path, mark = tmp_path / "points.csv", next((m for m in ";," if m in header), " ")
    np.savetxt(
        path, written, delimiter=mark, header=header, comments="", fmt="%.17g", encoding="utf-8"
    )
    check(MeasuredProfile.read(path, unit=unit))


def test_headings_of_grids_tell_a_unit(tmp_path):
    path = tmp_path / "grid.csv"
    path.write_text("first [mm],second [mm]\n1,2\n3,4\n")
    grid = MeasuredProfile.read(path, 1.0, peaks=False)
    assert grid([[0.5], [1.5]]) == pytest.approx(2e-3)
    path.write_text("x [kN],y,z\n1,2,3\n4,5,6\n7,9,9\n")
    with pytest.raises(ValueError, match=r"a unit of length, mm, .* got 'kN'"):
        MeasuredProfile.read(path)


@pytest.mark.parametrize("mark", [",", ";", " "])
@pytest.mark.parametrize(("head", "size"), [("z [um]", 1e-6), ("# z [um]", 1e-6), ("height", 1.0)])
def test_one_heading_above_a_grid(tmp_path, mark, head, size):
    path = tmp_path / "grid.csv"
    path.write_text(f"{head}\n1{mark}2\n3{mark}4\n")
    grid = MeasuredProfile.read(path, 1.0, peaks=False)
    assert grid([[0.5], [1.5]]) == pytest.approx(2 * size)
    path.write_text("height [raw]\n1 2\n3 4\n")
    with pytest.raises(ValueError, match="got 'raw'"):
        MeasuredProfile.read(path, 1.0)


def test_three_lines_of_heights_with_spacing_are_a_grid(tmp_path):
    file = tmp_path / "three.csv"
    np.savetxt(file, HEIGHTS.T, delimiter=",")
    profile = MeasuredProfile.read(file, SPACING[::-1], ORIGIN[::-1])
    assert profile(points()[::-1]) == pytest.approx(HEIGHTS.max() - HEIGHTS)


@pytest.mark.parametrize(
    "first",
    [",,", "NA,NA,NA", "BAD,BAD,BAD", '"7","8","9"', "7f,8f,9f", "--,--,--", "\u22121,2,x"],
)
def test_a_first_line_without_numbers_is_no_heading(tmp_path, first):
    """It was left out without a word, and the heights moved by a line."""
    path = tmp_path / "a.csv"
    path.write_text(first + "\n1,2,3\n4,5,6\n7,8,9\n", encoding="utf-8")
    with pytest.raises(ValueError, match="expected numbers in columns"):
        MeasuredProfile.read(path, spacing=1.0)
    for heading in ("a,b,c", '"a","b",', "height, map of, sample A"):
        path.write_text(heading + "\n1,2,3\n4,5,6\n7,8,9\n")
        assert MeasuredProfile.read(path, spacing=1.0)


def test_one_spacing_is_that_of_both_directions(tmp_path):
    file = tmp_path / "grid.npy"
    np.save(file, HEIGHTS)
    both = MeasuredProfile.read(file, (0.25, 0.25), ORIGIN)
    one = MeasuredProfile.read(file, np.float32(0.25), ORIGIN)
    assert [a.tolist() for a in one.x] == [a.tolist() for a in both.x]
    with pytest.raises(ValueError, match="positive distances for spacing"):
        MeasuredProfile.read(file, 0)


def fake(monkeypatch, found):
    """SurfaceTopography in so far as it is used."""
    package, exceptions = ModuleType("SurfaceTopography"), ModuleType("Exceptions")

    class CannotDetectFileFormat(Exception):
        pass

    def read(path):
        if found is None:
            raise CannotDetectFileFormat("no reader knows it")
        return found

    exceptions.CannotDetectFileFormat = CannotDetectFileFormat
    package.read_topography, package.Exceptions = read, exceptions
    monkeypatch.setitem(sys.modules, "SurfaceTopography", package)
    monkeypatch.setitem(sys.modules, "SurfaceTopography.Exceptions", exceptions)


def topography(heights=HEIGHTS, sizes=(1.5, 1.0), dim=2, uniform=True, unit=None):
    made = SimpleNamespace(
        dim=dim, is_uniform=uniform, physical_sizes=sizes, heights=lambda: heights, unit=None
    )
    if unit is not None:
        made.unit = unit
        scaled = np.array(sizes) * SCALE[unit], heights * SCALE[unit]
        made.to_unit = lambda other: topography(
            scaled[1] / SCALE[other], tuple(scaled[0] / SCALE[other])
        )
    return made


def test_instruments(tmp_path, monkeypatch):
    file = tmp_path / "surface.x3p"
    file.write_bytes(b"...")
    fake(monkeypatch, topography())
    check(MeasuredProfile.read(file, origin=ORIGIN))
    fake(monkeypatch, topography(1e3 * HEIGHTS, (1.5e3, 1e3), unit="mm"))
    check(MeasuredProfile.read(file, origin=ORIGIN))
    in_mm = MeasuredProfile.read(file, unit="mm")
    assert in_mm.height.max() == pytest.approx(1e3 * HEIGHTS.max())
    assert in_mm.x[0][0] == pytest.approx(250.0)
    with pytest.raises(ValueError, match='expected unit "m", "mm" or "µm", got \'inch\''):
        MeasuredProfile.read(file, unit="inch")
    fake(monkeypatch, topography(sizes=None))
    check(MeasuredProfile.read(file, SPACING, ORIGIN))
    for found, message in (
        (topography(sizes=None), "spacing=\\(dx, dy\\) for .*, which tells no sizes"),
        (topography(dim=1), "map of heights"),
        (topography(np.ma.masked_equal(HEIGHTS, 1.0)), r"nan at index \(0, 1\), 1 in all"),
        (None, "can be read in .*: no reader knows it"),
    ):
        fake(monkeypatch, found)
        with pytest.raises(ValueError, match=message):
            MeasuredProfile.read(file)


def test_an_instrument_without_the_package(tmp_path, monkeypatch):
    file = tmp_path / "surface.sdf"
    file.write_bytes(b"...")
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    with pytest.raises(ImportError, match=r"pip install 'skfem-dual\[surfaces\]'"):
        MeasuredProfile.read(file)


@pytest.mark.parametrize(
    ("name", "content", "options", "message"),
    [
        ("a.csv", "1,2\n3,4\n", {}, "three columns x, y and height .*, got 2"),
        ("a.csv", "1,2,3\n4,5,6\n", {"origin": (0, 1)}, "origin= for a grid of heights only"),
        ("a.csv", "1,2,3\n", {"spacing": (1, 1)}, r"two heights or more .* shape \(1, 3\)"),
        ("a.csv", "", {}, "numbers in columns .*there are none"),
        ("a.csv", "x,y,z\n", {}, "numbers in columns .*there are none"),
        ("a.csv", "1,2,3\n4,5\n", {}, "columns .*: line 2 has 2 columns, the first 3"),
        ("a.csv", "# by hand\n1,2\n3,\n", {"spacing": (1, 1)}, "got '' in line 3, column 2"),
        ("a.csv", "1 2\n-- 4\n", {"spacing": (1, 1)}, "got '--' in line 2, column 1"),
        ("a.csv", "1,2\nnan,4\n", {"spacing": (1, 1)}, r"got nan at index \(1, 0\), 1 in all"),
        ("a.csv", "1,2\n3,4\n", {"spacing": (1, 0)}, "positive distances for spacing"),
        ("a.npy", "no array", {"spacing": (1, 1)}, "numbers in"),
    ],
)
def test_bad_files(tmp_path, name, content, options, message):
    file = tmp_path / name
    file.write_text(content)
    with pytest.raises(ValueError, match=message):
        MeasuredProfile.read(file, **options)


def test_a_text_in_latin_1_is_told_as_that_alone(tmp_path):
    file = tmp_path / "a.csv"
    file.write_bytes("x;y;Höhe\n1;2;3\n".encode("latin-1"))
    with pytest.raises(ValueError, match=r"^expected text in UTF-8 in ") as error:
        MeasuredProfile.read(file)
    assert str(error.value).count("Remedy") == 1


@pytest.mark.parametrize("unit", ["um", "\u00b5m", "\u03bcm"])
def test_micrometres_in_any_spelling(tmp_path, monkeypatch, unit):
    file = tmp_path / "surface.x3p"
    file.write_bytes(b"...")
    fake(monkeypatch, topography(unit="mm"))
    assert MeasuredProfile.read(file, unit=unit).height.max() == pytest.approx(1e3 * HEIGHTS.max())


def test_bad_arrays(tmp_path):
    file = tmp_path / "a.npy"
    for values in (np.zeros(3), np.zeros((2, 2), dtype=complex), np.array(["a", "b"])):
        np.save(file, values)
        with pytest.raises(ValueError, match="one array of numbers with two axes"):
            MeasuredProfile.read(file, (1, 1))
    with pytest.raises(FileNotFoundError):
        MeasuredProfile.read(tmp_path / "none.npy", (1, 1))
    with pytest.raises(TypeError, match="two numbers for spacing"):
        MeasuredProfile.read(file, "1.0")
    np.save(file, np.zeros((0, 3)))
    with pytest.raises(ValueError, match=r"expected places with heights in .*a\.npy, got none"):
        MeasuredProfile.read(file)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_and_remarks(tmp_path, separator):
    file = tmp_path / "grid.csv"
    np.savetxt(file, HEIGHTS, delimiter=separator, fmt="%.15f")
    file.write_text("# measured, by hand\n" + file.read_text().replace(".", ","))
    check(MeasuredProfile.read(file, SPACING, ORIGIN))
    file.write_text(file.read_text() + separator.join(["0.5", "1,5", "2", "3"]))
    with pytest.raises(ValueError, match=r"grid\.csv: .*Remedy: one decimal mark in all"):
        MeasuredProfile.read(file, SPACING, ORIGIN)


def test_commas_that_may_part_thousands_are_refused(tmp_path):
    file = tmp_path / "grid.csv"
    file.write_text("1,234;2,345\n3,456;4,567\n")
    with pytest.raises(ValueError, match=r"line 1: expected a number, got '1,234'") as error:
        MeasuredProfile.read(file, SPACING, ORIGIN)
    assert str(error.value).count("Remedy: ") == 1
    assert str(error.value).endswith("nothing between thousands, such as 1234 or 1,2340")


def test_a_surface_is_told_in_a_line(tmp_path):
    profile = MeasuredProfile(([0.0, 0.5], [1.0, 2.0, 4.0]), [[0, 1, 2], [1, 2, 3.5]])
    shown = "MeasuredProfile(2 x 3 heights, 0 to 3.5, at x 0 to 0.5, y 1 to 4)"
    assert repr(profile) == shown
    scattered = MeasuredProfile([[0.0, 1.0, 0.0], [0.0, 0.0, 2.0]], [0.0, 0.25, -1.0])
    assert repr(scattered) == "MeasuredProfile(3 heights, -1 to 0.25, at x 0 to 1, y 0 to 2)"


def test_headings_in_remarks_and_in_quotes(tmp_path):
    """As numpy and R write them."""
    rows = np.vstack([points().reshape(2, -1), HEIGHTS.ravel()]).T[:, [1, 0, 2]]
    path = tmp_path / "points.csv"
    np.savetxt(path, rows * [1e3, 1e3, 1e6], delimiter=",", header="y [mm],x [mm],z [um]")
    check(MeasuredProfile.read(path))
    np.savetxt(path, rows, header='"y" "x" "z"', comments="")
    check(MeasuredProfile.read(path))
    np.savetxt(path, rows[:, [1, 0, 2]], header="measured on Monday by X and Y")
    check(MeasuredProfile.read(path))
    np.savetxt(path, rows, header="y in mm x in mm z in um", comments="")
    with pytest.raises(ValueError, match="a heading for each of the 3 columns"):
        MeasuredProfile.read(path)
    np.savetxt(path, rows, delimiter=",", header="x,y,height (mean)", comments="")
    with pytest.raises(ValueError, match=r"got 'mean'. Remedy: no brackets around"):
        MeasuredProfile.read(path)
