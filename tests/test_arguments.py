"""Checks of arguments: what passes comes out plain, what does not is named with its place."""

import sys
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from skfem_dual.arguments import (
    checked_array,
    checked_choice,
    checked_indices,
    checked_instance,
    checked_integer,
    checked_number,
    checked_pair,
    checked_points,
    checked_size,
)
from skfem_dual.messages import shown

NO_NUMBER = [
    None,
    True,
    np.True_,
    "1",
    np.str_("1"),
    b"1",
    1j,
    np.complex128(1),
    [1.0],
    np.array([1.0]),
    np.array(True),
    np.timedelta64(1, "s"),
    float,
    {},
    object(),
]


@pytest.mark.parametrize(
    "value",
    [2, 2.0, np.int8(2), np.uint64(2), np.array(2, ">f8"), Fraction(2), Decimal(2)],
)
def test_numbers_of_all_kinds_come_out_as_floats(value):
    number = checked_number("force", value)
    assert type(number) is float
    assert number == 2


@pytest.mark.parametrize("value", NO_NUMBER, ids=shown)
def test_what_is_no_number_is_refused_by_name(value):
    with pytest.raises(TypeError, match="expected a number for force, got "):
        checked_number("force", value)
    with pytest.raises(TypeError, match="expected an integer for n, got "):
        checked_integer("n", value)


@pytest.mark.parametrize(
    "value", [np.nan, np.inf, -np.inf, 10**400, -(10**400), Fraction(10**400), np.float32("inf")]
)
def test_numbers_are_finite(value):
    with pytest.raises(ValueError, match="expected a finite force, got "):
        checked_number("force", value)


@pytest.mark.skipif(np.finfo(np.longdouble).max == np.finfo(float).max, reason="no long doubles")
def test_long_doubles_beyond_doubles_are_refused():
    huge = np.longdouble("1e4000")
    with pytest.raises(ValueError, match="finite force"):
        checked_number("force", huge)
    with pytest.raises(ValueError, match="finite p, got inf at index 1"):
        checked_array("p", np.array([1, huge]), (2,))


@pytest.mark.parametrize(
    ("limits", "good", "bad", "text"),
    [
        ({"above": 0}, 1e-300, 0.0, "a positive x, got 0"),
        ({"above": 0}, 1e-300, -1.0, "a positive x, got -1"),
        ({"above": 0}, 1e-300, 5e-324, r"x of at least 2.23e-308, got 5e-324"),
        ({"at_least": 0, "at_most": 0.5}, 0.5, 0.51, "x from 0 to 0.5, got 0.51"),
        ({"at_least": 0, "at_most": 0.5}, 0.5, 0.50000001, "x from 0 to 0.5, got 0.50000001"),
        ({"at_least": 0, "below": 1}, 0, 1, "x of at least 0 and below 1, got 1"),
        ({"above": -1, "at_most": 1}, 1, -1, "x above -1 and of at most 1, got -1"),
        ({"above": 0, "below": 1}, 0.5, 1, "x above 0 and below 1, got 1"),
        ({"at_least": 3}, 3, 2.5, "x of at least 3, got 2.5"),
    ],
)
def test_limits(limits, good, bad, text):
    assert checked_number("x", good, **limits) == good
    with pytest.raises(ValueError, match=f"^expected {text}$"):
        checked_number("x", bad, **limits)


def test_sizes_leave_room_for_products():
    assert checked_size("radius", 1e100) == 1e100
    for value in (1e101, 1e-101):
        with pytest.raises(ValueError, match=r"radius from 1e-100 to 1e.100, got .*units"):
            checked_size("radius", value)
    with pytest.raises(ValueError, match="positive radius"):
        checked_size("radius", -1)


def test_integers():
    assert type(checked_integer("n", np.int16(7), at_least=7)) is int
    for value in (3.0, np.float64(3), "3"):
        with pytest.raises(TypeError, match="integer for n"):
            checked_integer("n", value)
    with pytest.raises(ValueError, match="n of at least 1, got 0"):
        checked_integer("n", 0, at_least=1)
    with pytest.raises(ValueError, match="n from 1 to 9, got an integer of 400 digits"):
        checked_integer("n", 10**400 - 1, at_least=1, at_most=9)
    huge = 10 ** (sys.get_int_max_str_digits() + 10)  # Python refuses to print it
    with pytest.raises(ValueError, match=r"n from 1 to 9, got an integer of .* digits"):
        checked_integer("n", huge, at_least=1, at_most=9)


def test_pairs():
    assert checked_pair("at", np.array([1, 2], ">i4")) == (1.0, 2.0)
    for value in (None, 1.0, (1.0,), (1, 2, 3), "ab", {1, 2}, {1: 2, 3: 4}, np.zeros((3, 2))):
        with pytest.raises(TypeError, match="two numbers for at, got "):
            checked_pair("at", value)
    for value in ((1, "2"), np.zeros((2, 2)), (None, 1), np.array([1, 2j])):
        with pytest.raises(TypeError, match=r"number for at\[[01]\]"):
            checked_pair("at", value)
    with pytest.raises(ValueError, match=r"finite at\[1\], got nan"):
        checked_pair("at", (1, np.nan))


GRID = np.arange(6.0).reshape(2, 3)


@pytest.mark.parametrize(
    "value",
    [
        GRID,
        GRID.tolist(),
        tuple(map(tuple, GRID)),
        GRID.astype(">f8"),
        GRID.astype("<f8"),
        GRID.astype(">i2"),
        GRID.astype("f4"),
        np.asfortranarray(GRID),
        np.dstack([GRID, GRID])[:, ::-1, 0][:, ::-1],
        np.ma.array(GRID),
        GRID.view(np.matrix),
    ],
    ids=lambda v: f"{type(v).__name__}-{getattr(v, 'dtype', '')}",
)
def test_arrays_of_all_kinds_come_out_plain(value):
    array = checked_points("x", value)
    assert type(array) is np.ndarray
    assert array.dtype.isnative
    assert array.dtype == float
    assert array.flags.c_contiguous
    np.testing.assert_array_equal(array, GRID)


def test_plain_arrays_are_not_copied():
    x = GRID.copy()
    x.setflags(write=False)
    assert checked_points("x", x) is x


@pytest.mark.parametrize(
    "value",
    [
        *(None, "ab", [["a"]], [[None]], [[True]], [[1j]], [[1], [2, 3]], object(), float, {}),
        *(GRID.astype(object), GRID.astype(bool), GRID + 0j, GRID.astype("U"), [[10**400], [1]]),
    ],
    ids=lambda v: str(v)[:20],
)
def test_what_is_no_array_of_numbers_is_refused_by_name(value):
    with pytest.raises(TypeError, match="expected x as an array of numbers, got "):
        checked_points("x", value)


def test_arrays_name_the_first_place():
    with pytest.raises(TypeError, match="got None at index 1, 0"):
        checked_array("x", [[0, 1], [None, "a"]], (2, 2))
    with pytest.raises(TypeError, match="got None at index 1"):
        checked_array("x", [np.int64(1), None], ("n",))
    with pytest.raises(TypeError, match="got an integer of 400 digits at index 1"):
        checked_array("x", [0, 10**400 - 1], ("n",))
    bad = GRID.copy()
    bad[1, 2] = np.inf
    with pytest.raises(ValueError, match="finite x, got inf at point 2"):
        checked_points("x", bad)
    with pytest.raises(ValueError, match="masked"):
        checked_points("x", np.ma.masked_greater(GRID, 2))


def test_masked_numbers_are_no_zeros():
    """What is missing in a table of loads was taken for 0, or for the value under the mask."""
    pair = np.ma.masked_array([0.2, 0.3], [False, True])
    for value in (np.ma.masked, pair[1], np.ma.masked_array(5, True)):
        with pytest.raises(ValueError, match="expected force without masked values"):
            checked_number("force", value)
        with pytest.raises(ValueError, match="expected n without masked values"):
            checked_integer("n", value)
    with pytest.raises(ValueError, match=r"expected at\[1\] without masked values"):
        checked_pair("at", pair)
    assert checked_number("force", np.ma.masked_array(5.0, False)) == 5.0


def test_shapes_have_names():
    assert checked_array("m", np.eye(3), ("n", "n")).shape == (3, 3)
    for value, text in (
        (GRID, r"\(n, n\), got \(2, 3\)"),
        (np.zeros(3), r"\(n, n\), got \(3,\)"),
        (1.0, r"\(n, n\), got \(\)"),
    ):
        with pytest.raises(ValueError, match="m of shape " + text):
            checked_array("m", value, ("n", "n"))
    with pytest.raises(ValueError, match=r"p of shape \(5,\), got \(4,\)"):
        checked_array("p", np.ones(4), (5,))
    with pytest.raises(ValueError, match=r"x of shape \(2, n\), got \(3, 2\). Remedy: transpose"):
        checked_points("x", GRID.T)
    with pytest.raises(ValueError, match="x with at least 4 items, got 3"):
        checked_points("x", GRID, least=4)
    assert checked_points("x", np.empty((2, 0))).shape == (2, 0)
    assert checked_array("x", [], ("n",)).dtype == float


def test_indices():
    for value in ([0, 2], np.array([0, 2], ">i8"), np.array([0, 2], "u1"), (0, 2)):
        found = checked_indices("cells", value, 3)
        assert found.dtype == np.intp
        assert found.tolist() == [0, 2]
    assert checked_indices("cells", [], 3).shape == (0,)
    for value in ([0.0], [True], None, "a", [None], np.empty(0, bool), [[1], [2, 3]], [10**400]):
        with pytest.raises(TypeError, match="cells as an array of integers"):
            checked_indices("cells", value, 3)
    for value, text in (([0, -1], "-1 at cell 1"), (np.uint64([2**63]), f"{2**63} at cell 0")):
        with pytest.raises(ValueError, match=f"cells from 0 to 2, got {text}"):
            checked_indices("cells", value, 3, each="cell")
    with pytest.raises(ValueError, match="cells of nothing, got 0 at index 0"):
        checked_indices("cells", [0], 0)


def test_objects():
    value = {}
    assert checked_instance("case", value, (dict, list)) is value
    with pytest.raises(TypeError, match=r"a dict or list for case, got None$"):
        checked_instance("case", None, (dict, list))
    with pytest.raises(TypeError, match=r"got the class dict\. Remedy: make an object of it"):
        checked_instance("case", dict, dict)
    with pytest.raises(TypeError, match=r"got 3\. Remedy: use a dict"):
        checked_instance("case", 3, dict, remedy="use a dict")


def test_choices():
    assert checked_choice("grid", "dual", ("dual", "primal")) == "dual"
    with pytest.raises(ValueError, match='grid "dual" or "primal", got \'\''):
        checked_choice("grid", "", ("dual", "primal"))
    for value in (None, 1, b"dual", ["dual"], str):
        with pytest.raises(TypeError, match='grid "dual" or "primal", got '):
            checked_choice("grid", value, ("dual", "primal"))


class Unprintable:
    def __repr__(self):
        raise RuntimeError


def test_messages_are_short_whatever_comes():
    deep: list = []
    for _ in range(1000):
        deep = [deep]
    table = [[0.1] * 9] * 9
    for value in (
        "a" * 10**6,
        list(range(10**5)),
        table,
        Unprintable(),
        [Unprintable()],
        deep,
        10**9999,
    ):
        assert len(shown(value)) < 200
