"""Punches whose surface was measured: heights at points, and between them."""

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from os import PathLike
from typing import Self

import numpy as np
import scipy
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import (
    Pair,
    checked_array,
    checked_choice,
    checked_flag,
    checked_pair,
)
from ..elements.balance import LINE, can_balance
from ..grids.polygons import readonly
from ..kernels.once import FromFields, computed_once
from ..messages import apart, place, shown

#: points so many distances of heights beyond a grid of them are on its rim
OUTSIDE = 1e-9
#: µm, and other ways to write it: without the sign, and with the Greek letter that looks like it
MICROMETRES = "µm", "um", "\u03bcm"


@dataclass(frozen=True, eq=False)
class MeasuredProfile(FromFields):
    """Heights measured at points, linear between them.

    Points that fill a rectangular grid are found to do so, in whatever order they come: between
    them heights are bilinear. Others are triangulated, once.

    Parameters
    ----------
    x : (2, m) array of float, or pair of arrays of shape (nx,) and (ny,)
        The points; their convex hull must cover the plan. Or the coordinates, each ascending, of
        a grid of them.
    height : (m,) or (nx, ny) array of float
        Heights of the punch's surface above any level, positive away from the ground.
    in_middles : bool
        Whether heights of a grid are those in the middles of rectangles, as of pixels: they then
        are continued to the ends of these. If not, nothing is known beyond the points.

    Raises
    ------
    TypeError, ValueError
        If something is no number, there are less than three points or not as many heights, the
        points lie on a line or have two heights, the coordinates of a grid do not ascend, or
        scattered heights are said to be in middles.

    Examples
    --------
    >>> profile = MeasuredProfile(([0.0, 1.0], [0.0, 1.0, 2.0]), [[0, 1, 2], [1, 2, 3]])
    >>> float(profile([0.5, 1.5]))
    2.0
    """

    x: ndarray | tuple[ndarray, ndarray]
    height: ndarray
    in_middles: bool = False

    def __post_init__(self) -> None:
        height = checked_array("height", self.height, None)
        checked_flag("in_middles", self.in_middles)
        if height.ndim == 2:
            axes = _axes(self.x)
            checked_array("height", height, (len(axes[0]), len(axes[1])))
            object.__setattr__(self, "x", axes)
        else:
            x = checked_array("x", self.x, (2, "m"), least=3, each="point")
            checked_array("height", height, x.shape[1:])
            _require_surface(x, height)
            object.__setattr__(self, "x", readonly(x))
        object.__setattr__(self, "height", readonly(height))
        if self.in_middles and self._grid is None:
            raise ValueError("expected heights on a grid with in_middles=True, got scattered ones")

    @classmethod
    def read(
        cls,
        path: str | PathLike[str],
        spacing: float | Pair | None = None,
        origin: Pair = (0.0, 0.0),
        *,
        unit: str = "m",
        peaks: bool = True,
    ) -> Self:
        """The surface of a punch from a file of heights, as instruments write them.

        Parameters
        ----------
        path : path
            ``.npy``, or ``.csv`` and ``.txt``: with ``spacing`` a grid of heights, the first index
            (of a text the line) along x and the second along y; without it three columns x, y
            and height, or as headings of x and y tell. All other formats, ``.x3p`` and ``.sdf``
            among them, through SurfaceTopography, with the spacing of the file.
        spacing : float or pair of float, optional
            Distances of the heights along x and along y, or one for both.
        origin : pair of float
            Corner of the rectangle of which the heights of a grid are in the middles of equal
            parts, so that they are at the centroids of ``MeshQuad.init_tensor`` from there on;
            plans may cover all of it.
        unit : str
            The unit wanted, "m", "mm" or "µm", also as "um"; files that tell theirs, as ``.x3p``
            does and columns with headings such as ``z [um]``, are changed to it. The others are
            taken as they are.
        peaks : bool
            Whether the highest points touch first, as of a surface measured face up that is then
            turned over: the gap is the largest height less the height. If not, heights are gaps.

        Raises
        ------
        FileNotFoundError, ValueError, TypeError
            If there is no such file, or it is something else; the first height that is no number.
        ImportError
            If SurfaceTopography is needed and missing.
        """
        from ..io.surfaces import read_heights

        peaks = checked_flag("peaks", peaks)
        if isinstance(unit, str) and unit in MICROMETRES:
            unit = MICROMETRES[0]
        checked_choice("unit", unit, ("m", "mm", "µm"))
        x, height = read_heights(path, spacing, checked_pair("origin", origin), unit)
        return cls(x, height.max() - height if peaks else height, in_middles=height.ndim == 2)

    @classmethod
    def from_heights(
        cls,
        height: ArrayLike,
        spacing: float | Pair,
        origin: Pair = (0.0, 0.0),
        *,
        peaks: bool = True,
    ) -> Self:
        """The surface of a punch from a grid of heights, as other programs have it.

        Parameters
        ----------
        height : (nx, ny) array of float
            The first index along x, the second along y.
        spacing, origin, peaks
            As of `read`.

        Raises
        ------
        ValueError, TypeError
            If something is no number, or there are less than two heights in a direction.

        Examples
        --------
        >>> bumps = MeasuredProfile.from_heights([[0.0, 1.0], [1.0, 3.0]], spacing=0.5)
        >>> bumps([[0.25, 0.75], [0.25, 0.75]]).tolist()
        [3.0, 0.0]
        """
        height = checked_array("height", height, ("nx", "ny"))
        if min(height.shape) < 2:
            raise ValueError(
                "expected a grid of two heights or more in both directions, got shape "
                f"{height.shape}"
            )
        places = middles(height.shape, checked_spacing(spacing), checked_pair("origin", origin))
        gap = height.max() - height if checked_flag("peaks", peaks) else height
        return cls(places, gap, in_middles=True)

    def __call__(self, x: ArrayLike) -> ndarray:
        """Gap at points of shape (2, ...).

        Raises
        ------
        TypeError, ValueError
            If they are none, or outside of what was measured.
        """
        x = checked_array("x", x, (2, "..."), each="point")
        height = self._between(x.reshape(2, -1).T).reshape(x.shape[1:])
        if np.isnan(height).any():
            bad = np.argmax(np.isnan(height))
            raise ValueError(
                "expected points measured around the whole plan; "
                f"{place(x.reshape(2, -1)[:, bad])} is outside them"
            )
        return height

    @computed_once
    def _grid(self) -> tuple[tuple[ndarray, ndarray], ndarray] | None:
        """Coordinates and heights (nx, ny) of a grid; None if the points are none."""
        if isinstance(self.x, tuple):
            return self.x, self.height
        (x, i), (y, j) = _lines(self.x)
        place = i * len(y) + j
        if min(len(x), len(y)) < 2 or len(x) * len(y) != len(place):
            return None
        if (np.bincount(place, minlength=len(place)) != 1).any():
            return None
        height = np.empty(len(place))
        height[place] = self.height
        return (x, y), height.reshape(len(x), len(y))

    @computed_once
    def _between(self) -> Callable[[ndarray], ndarray]:
        """Heights at points (m, 2); NaN outside of those measured."""
        if self._grid is None:
            return _triangulated(np.asarray(self.x), self.height)
        grid, height = self._grid
        bilinear = scipy.interpolate.RegularGridInterpolator(
            grid, height, bounds_error=False, fill_value=None
        )
        # on the rim but for rounding is not outside
        slack = (0.5 if self.in_middles else 0.0) + OUTSIDE
        digits = 4 * max(np.spacing(np.abs(part).max()) for part in grid)
        low = np.array([part[0] - slack * (part[1] - part[0]) - digits for part in grid])
        high = np.array([part[-1] + slack * (part[-1] - part[-2]) + digits for part in grid])

        def between(x: ndarray) -> ndarray:
            measured = ((low <= x) & (x <= high)).all(axis=1)
            return np.where(measured, bilinear(x), np.nan)

        return between

    def __repr__(self) -> str:
        extent = (f"{part.min():.6g} to {part.max():.6g}" for part in self.x)
        return (
            f"MeasuredProfile({' x '.join(map(str, self.height.shape))} heights, "
            f"{self.height.min():.6g} to {self.height.max():.6g}, at x {', y '.join(extent)})"
        )


def checked_spacing(spacing: float | Pair) -> Pair:
    """Distances along x and along y, or one for both."""
    both = checked_pair("spacing", (spacing, spacing) if isinstance(spacing, Real) else spacing)
    if min(both) <= 0:
        raise ValueError(f"expected positive distances for spacing, got {both}")
    return both


def middles(shape: tuple[int, ...], spacing: Pair, origin: Pair) -> tuple[ndarray, ndarray]:
    """Coordinates of the middles of equal rectangles from a corner on, along x and along y."""
    x, y = (o + d * (np.arange(n) + 0.5) for o, d, n in zip(origin, spacing, shape, strict=True))
    return x, y


def _lines(x: ndarray) -> list[tuple[ndarray, ndarray]]:
    """Coordinates along x and along y, ascending, and which of them each point (2, n) has; those
    that differ by rounding count as one."""
    slack = max(OUTSIDE * np.ptp(x, axis=1).max(), 4 * np.spacing(np.abs(x).max()))
    lines = []
    for part in x:
        different, which = np.unique(part, return_inverse=True)
        number = np.cumsum(np.diff(different, prepend=different[0]) > slack)
        lines.append((np.bincount(number, different) / np.bincount(number), number[which]))
    return lines


def _triangulated(x: ndarray, height: ndarray) -> Callable[[ndarray], ndarray]:
    """Heights at points (m, 2), linear in triangles between others (2, n); NaN outside."""
    # Delaunay's circles need the digits that coordinates far from the origin have lost
    middle, scale = x.mean(axis=1), np.ptp(x, axis=1).max()
    inwards = 1 - max(OUTSIDE, 8 * np.spacing(np.abs(x).max()) / scale)
    linear = scipy.interpolate.LinearNDInterpolator((x.T - middle) / scale, height)

    def between(x: ndarray) -> ndarray:
        at = (x - middle) / scale
        found = linear(at)
        beyond = np.isnan(found)
        if beyond.any():  # on the rim but for rounding is not outside
            found[beyond] = linear(inwards * at[beyond])
        return found

    return between


def _require_surface(x: ndarray, height: ndarray) -> None:
    """Refuse points on a line, and those with two heights."""
    if not can_balance(x, np.ones(len(height), dtype=bool), LINE):
        first, last = x[:, np.lexsort(x)[[0, -1]]].T
        raise ValueError(
            f"expected points around a plan for x, got all on a line from {place(first)} to "
            f"{place(last)}. Remedy: for a shape that is the same across the line, its heights on "
            "both sides of the plan"
        )
    order = np.lexsort((np.arange(len(height)), *x))
    same = (np.diff(x[:, order]) == 0).all(axis=0)
    twice = np.nonzero(same & (np.diff(height[order]) != 0))[0]
    if len(twice):
        i, j = order[twice[0]], order[twice[0] + 1]
        one, other = apart(height[i], height[j])
        raise ValueError(
            f"expected one height at each point, got {one} and {other} at {place(x[:, i])}, "
            f"points {i} and {j}. Remedy: keep one of them, or their mean"
        )


def _axes(x: object) -> tuple[ndarray, ndarray]:
    """The coordinates of a grid along x and along y."""
    if not isinstance(x, (tuple, list)) or len(x) != 2:
        raise TypeError(
            "expected the coordinates of a grid along x and along y for x, with heights of "
            f"shape (nx, ny), got {shown(x)}"
        )
    axes = tuple(checked_array(f"x[{i}]", x[i], ("n",), least=2) for i in (0, 1))
    for i, part in enumerate(axes):
        if (np.diff(part) <= 0).any():
            bad = int(np.argmax(np.diff(part) <= 0))
            last, got = apart(*part[bad : bad + 2])
            raise ValueError(
                f"expected ascending coordinates x[{i}] of a grid, got {got} after {last} at "
                f"index {bad + 1}"
            )
    return readonly(axes[0]), readonly(axes[1])
