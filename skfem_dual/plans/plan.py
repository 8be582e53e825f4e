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
)
from ..kernels.once import ReadOnly, computed_once
from .corners import bulge_of, ring_of
from .mesh import mesh_of, refined
from .parts import Part, Parts
from .rings import Ring

if TYPE_CHECKING:
    from os import PathLike

    from matplotlib.axes import Axes


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
        parts = Parts.checked(self.parts)
        object.__setattr__(self, "parts", parts.each)
        parts.require_apart()

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
        return cls(((ring_of("corners", corners, bulges), _rings("holes", holes)),))

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
        return cls(((outline, _rings("holes", holes)),))

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
        return cls(Parts.from_rings(_rings("rings", rings)).each)

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
            extent, if that is no more than 1e4 times that of its largest shape.

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
        return bulge_of(start, through, end)

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
        return Plan(Parts(self.parts).mapped(lambda x: x + shift))

    def scaled(self, factor: float) -> "Plan":
        """The plan with all coordinates multiplied, as by 1e-3 from millimetres to metres.

        Raises
        ------
        TypeError, ValueError
            If the factor is no number, or not positive.
        """
        factor = checked_size("factor", factor)
        return Plan(Parts(self.parts).mapped(lambda x: factor * x))

    @property
    def rings(self) -> list[Ring]:
        """Outline and holes, part by part."""
        return Parts(self.parts).rings

    @computed_once
    def area(self) -> float:
        """Area."""
        return Parts(self.parts).area

    @computed_once
    def centroid(self) -> ndarray:
        """Centre of area, shape (2,)."""
        return Parts(self.parts).centroid

    @computed_once
    def bounds(self) -> ndarray:
        """Lower left and upper right corner of the plan as columns, shape (2, 2)."""
        return Parts(self.parts).bounds

    @computed_once
    def hull(self) -> ndarray:
        """Corners of the plan's convex hull, many on arcs, the farthest along the axes among them,
        counter-clockwise; shape (2, k)."""
        return Parts(self.parts).hull

    @property
    def corners(self) -> ndarray:
        """Corners of all rings, where their direction changes; shape (2, k)."""
        return Parts(self.parts).corners

    @property
    def corner_angles(self) -> ndarray:
        """Angles of the plan in its `corners`, in radians, above pi if re-entrant; (k,)."""
        return Parts(self.parts).corner_angles

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
        return Parts(self.parts).contains(checked_array("x", x, (2, "...")))

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
        (left, right), (bottom, top) = self.bounds
        x, y = self.centroid
        return (
            "<skfem_dual Plan object>\n"
            f"  Parts: {len(self.parts)}, holes: {len(self.rings) - len(self.parts)}\n"
            f"  Sides: {Parts(self.parts).kinds_of_sides}\n"
            f"  Area: {self.area:.6g}\n"
            f"  Centroid: ({x:.10g}, {y:.10g})\n"
            f"  Extent: {left:.10g} to {right:.10g}, {bottom:.10g} to {top:.10g}"
        )


def _rings(name: str, values: Any) -> tuple[Ring, ...]:
    """Rings from a sequence of their corners, or of plans."""
    items = enumerate(checked_sequence(name, values))
    return tuple(_ring(f"{name}[{i}]", value) for i, value in items)


def _ring(name: str, value: Any) -> Ring:
    """A ring from its corners, or from a plan."""
    if isinstance(value, Plan):
        return Parts(value.parts).only_ring(name)
    return value if isinstance(value, Ring) else ring_of(name, value, None)
