"""Plans of footings: rings of straight sides, arcs and circles, with holes, in several parts."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import MeshTri

from ..arguments import (
    Pair,
    checked_array,
    checked_circle,
    checked_pair,
    checked_sequence,
    checked_size,
    shown,
)
from ..errors import MeshError
from ..grids.curves import require_digits
from ..grids.planar import convex_hull
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly, computed_once
from ..messages import place
from .corners import SAME, ring_of
from .crossings import nested, require_parts, require_simple
from .mesh import Part, mesh_of, refined
from .rings import SMOOTH, Ring
from .sides import bulge_through

if TYPE_CHECKING:
    from os import PathLike

    from matplotlib.axes import Axes


#: bulge of an arc that is no less than a whole circle, but for rounding
WHOLE = 1e12


@dataclass(frozen=True, eq=False, repr=False)
class Plan(ReadOnly):
    """Plan of a footing: where it may touch the ground.

    Make it by `from_polygon`, `circle`, `from_rings` or `read`; the sum of two plans has the
    parts of both.

    Attributes
    ----------
    parts : tuple of (Ring, tuple of Ring)
        Outline and holes of each part, counter-clockwise.

    Examples
    --------
    >>> plan = Plan.from_polygon([(0, 0), (12, 0), (12, 8), (0, 8)], holes=[
    ...     [(4, 3), (8, 3), (8, 5), (4, 5)], Plan.circle((2, 2), 0.5)])
    >>> print(plan)
    <skfem_dual Plan object>
      Parts: 1, holes: 2
      Sides: 8 straight, 1 circle
      Area: 87.2146
      Centroid: (6.036021407, 4.018010703)
      Extent: 0 to 12, 0 to 8
    >>> plan.mesh(size=1.0).boundaries.keys()
    dict_keys(['edge', 'hole0', 'hole1'])
    """

    parts: tuple[Part, ...]

    def __post_init__(self) -> None:
        parts = tuple(map(_part, checked_sequence("parts", self.parts)))
        if not parts:
            raise ValueError("expected at least one part, got none")
        object.__setattr__(self, "parts", parts)
        names = _names(self.parts)
        require_digits(self.bounds)
        require_simple(self.rings, [name for part in names for name in part])
        require_parts(list(self.parts), names)

    @classmethod
    def from_polygon(
        cls,
        corners: ArrayLike | Sequence,
        holes: Sequence = (),
        *,
        bulges: ArrayLike | None = None,
    ) -> "Plan":
        """Plan with the corners of an outline.

        Parameters
        ----------
        corners : sequence of pairs, or array of float
            Corners in order, in either sense, closed or not: pairs ``(x, y)``, an array (n, 2) or
            (2, n) with n > 3. Triples ``(x, y, bulge)`` tell the arcs as well.
        holes : sequence
            The holes, each as corners or as a `Plan` of one part without holes.
        bulges : (n,) array of float, optional
            Tangent of a quarter of the angle of the arc from each corner to the next, 0 for a
            straight side, positive if it turns left on the way, as in DXF; `bulge` finds it from
            three points.

        Raises
        ------
        TypeError
            If something is no number.
        ValueError
            If corners are no pairs or triples, bulges are not as many, or there are both.
        MeshError
            If corners repeat or lie on one line, sides cross or touch, a hole is not inside or
            meets another one, or the outline is too far from (0, 0) for its size.

        Examples
        --------
        A square with a half circle on its right side:

        >>> plan = Plan.from_polygon([(0, 0), (2, 0, 1.0), (2, 2), (0, 2)])
        >>> print(f"{plan.area:.4f}")  # 4 + pi / 2
        5.5708
        """
        return cls(((ring_of("corners", corners, bulges), _made("holes", holes)),))

    @classmethod
    def circle(cls, centre: Pair, radius: float, holes: Sequence = ()) -> "Plan":
        """Round plan.

        Parameters
        ----------
        centre : pair of float
            Its middle.
        radius : float
            Its radius.
        holes : sequence
            As in `from_polygon`.

        Raises
        ------
        TypeError, ValueError
            If something is no number, or the radius is not positive.
        MeshError
            If a hole is not inside or meets another one.

        Examples
        --------
        >>> ring = Plan.circle((0, 0), 1.0, holes=[Plan.circle((0.2, 0), 0.5)])
        >>> print(f"{ring.area / np.pi:.3f}")
        0.750
        """
        middle, radius = checked_circle(centre, radius)
        outline = Ring.circle(np.array(middle), radius)
        return cls(((outline, _made("holes", holes)),))

    @classmethod
    def from_rings(cls, rings: Sequence) -> "Plan":
        """Plan of rings in any order: what lies in an odd number of others is a hole.

        Parameters
        ----------
        rings : sequence
            Each as corners, as in `from_polygon`, or as a `Plan` of one part without holes.

        Raises
        ------
        TypeError
            If something is no number.
        ValueError
            If a ring has neither pairs nor triples.
        MeshError
            If there is no ring, corners repeat or lie on one line, or sides cross or touch.
        """
        made = list(_made("rings", rings))
        if not made:
            raise MeshError("expected at least one ring, got none")
        require_simple(made, [f"ring {i}" for i in range(len(made))])
        return cls(tuple((made[i], tuple(made[h] for h in holes)) for i, holes in nested(made)))

    @classmethod
    def read(
        cls, path: "str | PathLike[str]", *, layer: str | None = None, tol: float | None = None
    ) -> "Plan":
        """Plan from a file: CSV, WKT, GeoJSON or DXF, by its name.

        Parameters
        ----------
        path : path
            The file; `plans.read.read_plan` says what each kind holds.
        layer : str, optional
            The layer of a drawing; needed if it has shapes on several.
        tol : float, optional
            Distance within which ends of lines and arcs of a drawing join, by default 1e-6 of its
            extent.

        Returns
        -------
        Plan
            In the units of the file; `Plan.scaled` changes them.

        Raises
        ------
        FileNotFoundError, TypeError, ValueError, ImportError, MeshError
            As `plans.read.read_plan`, which says of what it warns, too.
        """
        from .read import read_plan

        return read_plan(path, layer=layer, tol=tol)

    @staticmethod
    def bulge(start: Pair, through: Pair, end: Pair) -> float:
        """Bulge of the arc from one corner to another through a third point.

        Parameters
        ----------
        start, through, end : pair of float
            The corners, and a point on the arc between them.

        Returns
        -------
        float
            Positive if the arc turns left on the way, 0 if the points lie on a line.

        Raises
        ------
        TypeError
            If something is no pair of numbers.
        ValueError
            If two of the points are the same, or ``through`` lies on the line beyond both.

        Examples
        --------
        >>> print(f"{Plan.bulge((0, 0), (1, -1), (2, 0)):.6f}")
        1.000000
        """
        pairs = {"start": start, "through": through, "end": end}
        a, m, b = (np.array(checked_pair(name, x)) for name, x in pairs.items())
        size = np.hypot(*(b - a))
        if size == 0 or min(np.hypot(*(m - a)), np.hypot(*(m - b))) <= SAME * size:
            raise ValueError("expected three points that differ from each other for an arc")
        bulge = bulge_through(a, m, b)
        if (m - a) @ (m - b) > 0 and (bulge == 0 or abs(bulge) > WHOLE):
            raise ValueError(
                f"expected a point between start and end for through, got {place(m)} beyond them "
                "on their line, where no arc leads"
            )
        return bulge

    def __add__(self, other: "Plan") -> "Plan":
        """The parts of both plans, which must not meet."""
        if not isinstance(other, Plan):
            return NotImplemented
        return Plan(self.parts + other.parts)

    def translated(self, vector: Pair) -> "Plan":
        """The plan moved by a vector, a pair of float.

        Raises
        ------
        TypeError, ValueError
            If it is none, or not finite.
        MeshError
            If the plan gets too far from (0, 0) for its size.
        """
        shift = np.array(checked_pair("vector", vector))[:, None]
        return self._mapped(lambda x: x + shift)

    def scaled(self, factor: float) -> "Plan":
        """The plan with all coordinates multiplied, as by 1e-3 from millimetres to metres.

        Raises
        ------
        TypeError, ValueError
            If the factor is no number, or not positive.
        """
        factor = checked_size("factor", factor)
        return self._mapped(lambda x: factor * x)

    def _mapped(self, move: Any) -> "Plan":
        def moved(ring: Ring) -> Ring:
            return Ring(readonly(move(ring.corners)), ring.bulges)

        return Plan(tuple((moved(o), tuple(map(moved, holes))) for o, holes in self.parts))

    @property
    def rings(self) -> list[Ring]:
        """Outline and holes, part by part."""
        return [ring for outline, holes in self.parts for ring in (outline, *holes)]

    @computed_once
    def area(self) -> float:
        """Area."""
        return float(sum(sign * ring.area for sign, ring in self._signed))

    @computed_once
    def centroid(self) -> ndarray:
        """Centre of area, shape (2,)."""
        middle = self.bounds.mean(axis=1)
        moments = sum(
            sign * (ring.first_moments - ring.area * middle) for sign, ring in self._signed
        )
        return readonly(middle + moments / self.area)

    @property
    def _signed(self) -> list[tuple[int, Ring]]:
        return [
            (sign, ring)
            for outline, holes in self.parts
            for sign, ring in ((1, outline), *((-1, hole) for hole in holes))
        ]

    @computed_once
    def bounds(self) -> ndarray:
        """Lower left and upper right corner of the plan as columns, shape (2, 2)."""
        boxes = np.hstack([outline.box for outline, _ in self.parts])
        return readonly(np.stack([boxes.min(axis=1), boxes.max(axis=1)], axis=1))

    @computed_once
    def hull(self) -> ndarray:
        """Corners of the plan's convex hull, many on arcs, the farthest along the axes among them,
        counter-clockwise; shape (2, k)."""
        sides = [outline.sides for outline, _ in self.parts]
        points = np.hstack([part for s in sides for part in (s.around(), s.extremes())])
        return readonly(convex_hull(points))

    @property
    def corners(self) -> ndarray:
        """Corners of all rings, where their direction changes; shape (2, k)."""
        return readonly(np.hstack([r.corners[:, np.abs(r.turns) > SMOOTH] for r in self.rings]))

    @property
    def corner_angles(self) -> ndarray:
        """Angles of the plan in its `corners`, in radians, above pi if re-entrant; (k,)."""
        angles = [
            np.pi - sign * ring.turns[np.abs(ring.turns) > SMOOTH] for sign, ring in self._signed
        ]
        return readonly(np.concatenate(angles))

    def contains(self, x: ArrayLike) -> ndarray:
        """Whether points of shape (2, ...) lie in the plan; on its edge either way.

        Raises
        ------
        TypeError, ValueError
            If they are no points, or not finite.

        Examples
        --------
        >>> Plan.circle((0, 0), 1.0).contains([[0.0, 2.0], [0.5, 0.0]])
        array([ True, False])
        """
        x = checked_array("x", x, (2, "..."))
        flat = x.reshape(2, -1)
        inside = sum(sign * ring.sides.winding(flat) for sign, ring in self._signed)
        return np.asarray(inside > 0).reshape(x.shape[1:])

    def mesh(
        self, size: float | None = None, n: int | None = None, *, graded: float | None = None
    ) -> MeshTri:
        """Triangulation of the plan.

        Parameters
        ----------
        size : float, optional
            Length of the facets, of the largest if graded.
        n : int, optional
            Number of nodes aimed at; either ``size`` or ``n`` is given. Sides, fillets and holes
            far smaller than the facets have small triangles around, and arcs shorter facets
            where parts would overlap, which may take more.
        graded : float, optional
            Length of the facets on the edge over ``size``, from 0 to 1; lengths grow by 0.2 for
            every unit of distance to the edge.

        Returns
        -------
        MeshTri
            With a valid dual grid, nodes in all corners, the area of the plan, and the boundaries
            ``edge`` and ``hole`` or ``hole0``, ``hole1``, ... Nodes on arcs lie so far outside
            them that the polygon through them has their area. Parts are components of their own.

        Raises
        ------
        TypeError, ValueError
            If an argument is wrong; `MeshError` if the size is too coarse for the plan.
        """
        return mesh_of(self.parts, size, n, graded)

    def refine(self, mesh: MeshTri, elements: ArrayLike | None = None) -> MeshTri:
        """A mesh of this plan with smaller triangles, on whose edge arcs stay arcs.

        Parameters
        ----------
        mesh : MeshTri
            Made by `mesh` or `refine`.
        elements : array of int, optional
            The triangles to refine, all by default.

        Returns
        -------
        MeshTri
            With a valid dual grid and the area of the plan; tags of boundaries as in `mesh`.

        Raises
        ------
        TypeError, ValueError
            If ``mesh`` is no MeshTri, or ``elements`` are no numbers of its triangles.
        MeshError
            If the mesh is not one of this plan, or no valid dual grid was found.
        """
        return refined(self.parts, mesh, elements)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """The plan drawn to scale with matplotlib, corners numbered, and its centroid.

        Parameters
        ----------
        ax : Axes, optional
            To draw in; new ones by default.

        Returns
        -------
        Axes
            ``ax.figure.savefig("plan.svg")`` writes a file.

        Raises
        ------
        TypeError
            If ``ax`` is something else.
        ImportError
            If matplotlib is missing.
        """
        from ..visuals.plans import draw_plan

        return draw_plan(self, ax)

    def __repr__(self) -> str:
        circles = sum(ring.is_circle for ring in self.rings)
        others = [ring for ring in self.rings if not ring.is_circle]
        arcs = sum(int(np.count_nonzero(ring.sides.curved)) for ring in others)
        straight = sum(len(ring.bulges) for ring in others) - arcs
        counts = {"straight": straight, "arc": arcs, "circle": circles}
        kinds = [
            f"{count} {word}{'s' * (count != 1 and word != 'straight')}"
            for word, count in counts.items()
            if count
        ]
        (left, right), (bottom, top) = self.bounds
        x, y = self.centroid
        return (
            "<skfem_dual Plan object>\n"
            f"  Parts: {len(self.parts)}, holes: {len(self.rings) - len(self.parts)}\n"
            f"  Sides: {', '.join(kinds)}\n"
            f"  Area: {self.area:.6g}\n"
            f"  Centroid: ({x:.10g}, {y:.10g})\n"
            f"  Extent: {left:.10g} to {right:.10g}, {bottom:.10g} to {top:.10g}"
        )


def _part(value: Any) -> Part:
    """A part as it should be."""
    match value:
        case [Ring() as outline, [*holes]] if all(isinstance(hole, Ring) for hole in holes):
            return outline, tuple(holes)
    raise TypeError(
        "expected a Ring and a tuple of Rings, its holes, for each of the parts of a Plan, got "
        f"{shown(value)}. Remedy: Plan.from_polygon(corners)"
    )


def _names(parts: Sequence[Part]) -> list[list[str]]:
    """What the rings are called in messages."""
    several = len(parts) > 1
    return [
        [
            f"the outline of part {i}" if several else "the outline",
            *(f"hole {h}" + f" of part {i}" * several for h in range(len(holes))),
        ]
        for i, (_, holes) in enumerate(parts)
    ]


def _made(name: str, values: Any) -> tuple[Ring, ...]:
    """Rings from a sequence of their corners, or of plans."""
    items = checked_sequence(name, values)
    return tuple(_hole(f"{name}[{i}]", value) for i, value in enumerate(items))


def _hole(name: str, value: Any) -> Ring:
    """A ring from its corners, or from a plan."""
    if isinstance(value, Ring):
        return value
    if not isinstance(value, Plan):
        return ring_of(name, value, None)
    if len(value.rings) != 1:
        raise ValueError(
            f"expected a Plan of one part without holes for {name}, got {len(value.parts)} parts "
            f"with {len(value.rings) - len(value.parts)} holes"
        )
    return value.rings[0]
