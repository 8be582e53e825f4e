"""Pressures of cells: what is answered about contact, whatever presses on the ground."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis
from skfem.assembly.basis import AbstractBasis

from ..arguments import checked_flag
from ..contact.footprint import Footprint
from ..contact.period import nodes_alike
from ..contact.pressed import Pressed, settlement
from ..contact.region import ContactRegion
from ..elements.balance import balanced
from ..elements.influence import flat_points
from ..elements.line_weights import LineWeights
from ..grids.lattice import Lattice
from ..grids.polygons import readonly
from ..ground.periodic import PeriodicGround
from ..kernels.once import computed_once
from ..messages import shown
from .edge_coefficient import EdgeCoefficient, coefficient_of
from .inside_cells import InsideCells
from .resultant import Resultant

#: distances over the extent of the plan that are printed as zero
ROUNDING = 1e-12


def checked_solution(name: str, value: Any) -> "CellPressures":
    """``value`` itself, if it is the solution of one body, or a TypeError."""
    if isinstance(value, CellPressures):
        return value
    raise TypeError(
        f"expected a PunchSolution or an ElasticSolution for {name}, got {shown(value)}. Remedy: "
        "punch.solve(...), of several bodies one of their solutions"
    )


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CellPressures(Resultant):
    """Pressures and gaps of the cells under a body.

    The attributes are described in `PunchSolution`. ``punch`` is the problem solved, of which only
    ``footprint`` and ``gap`` are used, ``others`` are those beside it.
    """

    punch: Any
    pressure: ndarray
    gap: ndarray
    resultant: ndarray
    displacement_residual: float
    complementarity_residual: float
    iterations: int
    success: bool
    message: str
    timings: dict[str, float]
    others: tuple[Pressed, ...] = ()
    flat: ndarray | None = None
    line: LineWeights | None = None

    @computed_once
    def footprint(self) -> Footprint:
        """The cells under the body, without slopes in those that are flat, weighted along the
        line of contact."""
        return Pressed(self.punch, self.pressure, self.flat, self.line).cells

    @computed_once
    def slopes(self) -> ndarray:
        """Slopes of the pressure over the law of the edge in each cell, see `Slopes`; (2, n)."""
        return self._inside.slopes

    @computed_once
    def _inside(self) -> InsideCells:
        """The pressure inside the cells."""
        return InsideCells(self.footprint, self.pressure, self.line)

    @property
    def all_pressures(self) -> tuple[tuple[Footprint, ndarray], ...]:
        """Cells and pressures of the body and of those beside it."""
        return (self.footprint, self.pressure), *((o.cells, o.pressure) for o in self.others)

    @property
    def mean_moments(self) -> ndarray:
        """Means of ``(p x, p y)`` over each cell, shape (2, n)."""
        return self.footprint.mean_moments(self.pressure, self.slopes)

    @property
    def contact(self) -> ndarray:
        """Cells in contact, indices, ascending."""
        touching = (self.pressure != 0) | (self.gap == 0)
        return readonly(np.nonzero(touching)[0].astype(np.int32))

    @computed_once
    def contact_region(self) -> ContactRegion:
        """Where punch and ground touch, with an edge that runs inside the cells."""
        known = self.pressure_in_points, self.gap, self.contact_modulus
        return self.region_of(self.punch.footprint.triangles.fitted(*known))

    def region_of(self, fitted: ContactRegion) -> ContactRegion:
        """With the cells in which no law is seen, see `PlanTriangles.with_thin`."""
        triangles, even = self.punch.footprint.triangles, self.punch.gap is None
        opening = self.gap * 0.75 * self.contact_modulus
        return triangles.with_thin(fitted, self.pressure_in_points, opening, even)

    @property
    def pressure_in_points(self) -> ndarray:
        """Pressures that tell where contact ends: those in the collocation points, (n,)."""
        if self.line is None:
            return self.pressure
        return np.where(self.gap == 0, self.line.at_points(self.pressure), 0.0)

    @property
    def contact_modulus(self) -> float:
        """E* of the ground's surface, by which gaps beside the contact open."""
        return self.footprint.contact_modulus

    @property
    def contact_area(self) -> float:
        """Area of the contact region; cells that touch alone or in thin clusters count whole."""
        return self.contact_region.area

    @property
    def mean_pressure(self) -> float:
        """Force over contact area; zero without contact."""
        area = self.contact_area
        return self.force / area if area > 0 and self.acts else 0.0

    def ground_displacement(self, x: ArrayLike) -> ndarray:
        """Settlement of the ground at any points of its surface.

        Parameters
        ----------
        x : (2, ...) array of float
            Points under the punch or beside it, in any shape, as ``w.x`` in a form.

        Returns
        -------
        (...) array of float
            Positive into the ground.

        Raises
        ------
        TypeError, ValueError
            If they are no points, not finite, or beyond what is known of the ground; on ground
            with a period.
        """
        x, shape = flat_points(x)
        return settlement(self.all_pressures, x).reshape(shape)

    def pressure_at(self, x: ArrayLike) -> ndarray:
        """Pressure at any points.

        Parameters
        ----------
        x : (2, ...) array of float
            Points, in any shape, as ``w.x`` in a form.

        Returns
        -------
        (...) array of float
            ``w / mean(w) (q + g . (x - y))`` inside each cell, see `Slopes`: infinite on a
            singular edge, zero beside the punch. Away from a `line` of contact of the second
            degree, see `Curvature`.

        Raises
        ------
        TypeError, ValueError
            If they are no points, or not finite.
        """
        x, shape = flat_points(x)
        return self._inside.at_points(x).reshape(shape)

    def load_vector(
        self,
        basis: AbstractBasis,
        *,
        order: int | None = None,
        component: int | None = None,
        partial: bool = False,
    ) -> ndarray:
        """The pressure as a load on finite elements: integrals of ``p v`` over the plan.

        Parameters
        ----------
        basis : CellBasis or FacetBasis
            Any scikit-fem basis on a 2-D mesh that covers the plan, or on facets of a 3-D mesh
            that do; see `load_matrix`.
        order, component, partial : optional
            As in `load_matrix`, but ``order`` at most 18.

        Returns
        -------
        (basis.N,) array of float
            Force and moments are those of the solution to rounding where the basis contains
            linear functions.

        Raises
        ------
        TypeError, ValueError
            As in `load_matrix`.

        Examples
        --------
        >>> from skfem import CellBasis, ElementTriP2, MeshTri
        >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
        >>> mesh = MeshTri.init_circle(3)
        >>> solution = RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(mesh).basis()).solve(1.0)
        >>> f = solution.load_vector(CellBasis(mesh, ElementTriP2()))
        >>> print(f"{f.sum():.12f}")
        1.000000000000
        """
        cells = self.footprint
        matrix = cells.load_matrix(basis, order=order, component=component, partial=partial)
        return cells.with_slopes(matrix) @ self.pressure

    def pressure_field(
        self, refine: int = 3, other: "CellPressures | None" = None
    ) -> tuple[CellBasis, ndarray]:
        """The pressure as a first-order field on a refinement of the mesh.

        It follows the laws of the edges of plan and contact and carries force and moments: the
        field to draw, and to take elsewhere.

        Parameters
        ----------
        refine, other
            As in `skfem_dual.pressure_field`.

        Returns
        -------
        basis : CellBasis
            ElementTriP1 on the refinement.
        values : (N,) array of float
            Its vector.
        """
        from ..post.fields import pressure_field

        return pressure_field(self, refine, other)

    def pressures_on(self, footprint: Footprint) -> ndarray:
        """Pressures of other cells, none negative, to begin a solution with; shape (n,)."""
        centroids = footprint.partition.centroids
        if np.array_equal(centroids, self.footprint.partition.centroids):
            return self.pressure.clip(0)
        pressure = self.pressure_at(centroids)
        return np.where(np.isfinite(pressure), pressure, 0.0).clip(0)

    def nodal_pressure(self, *, conserve: bool = True) -> tuple[CellBasis, ndarray]:
        """Pressure at the nodes of the mesh, linear inside each triangle (Section 4.2).

        On dual cells the node takes the pressure in its cell. On triangles and quadrilaterals it
        takes the mean over the cells around it, weighted by area. Nodes on a singular edge take
        the mean pressures of cells, finite where the pressure itself is not. On ground with a
        period cells go on beyond its edge.

        Parameters
        ----------
        conserve : bool
            Whether force and first moments of the field are those of the solution, by the least
            change of the values on a singular edge, or of all without one. On ground with a
            period the force is, whose place is arbitrary.

        Returns
        -------
        basis : CellBasis
            First-order basis on the mesh.
        values : (N,) array of float
            Its vector.

        Raises
        ------
        TypeError
            If ``conserve`` is neither True nor False.
        ConvergenceError
            If there are too few nodes to carry force and moments without tension.
        """
        conserve = checked_flag("conserve", conserve)
        nodal, values = self._inside.at_nodes()
        if isinstance(self.footprint.substrate, PeriodicGround):
            lattice = cast(Lattice, self.footprint.partition.lattice)
            return nodal, nodes_alike(lattice, nodal.mesh.p, values)
        if conserve:
            part, weights = None, self.footprint.weights
            if weights is not None and self.line is None:
                part = np.zeros(len(values), dtype=bool)
                part[nodal.mesh.facets[:, weights.facets]] = True
            values = balanced(nodal, values, self.resultant, self.footprint.origin, part)
        return nodal, values

    def edge_coefficient(self) -> EdgeCoefficient:
        """Strength of the pressure's singularity along the edge, the limit of ``p sqrt(d)``.

        Raises
        ------
        ValueError
            If the punch has no singular edge.
        """
        weights = self.punch.footprint.weights
        if weights is None:
            raise ValueError(
                'expected a punch with edge="singular", got constant pressures at the edge'
            )
        cells = self.footprint.partition
        return coefficient_of(cells, weights, self.pressure, self.slopes)

    def table(self) -> dict[str, str]:
        """Rows of ``repr`` by their names, without what may be had on demand."""
        return self._rows() | self._outcome()

    def _rows(self) -> dict[str, str]:
        """Those before the outcome."""
        p, e = self.pressure, self.centre_of_pressure
        where = "at no point"
        size = self.footprint.partition.extent
        if not np.isnan(e).any():
            e = np.where(np.abs(e) <= ROUNDING * size, 0.0, e)
            where = f"({e[0]:.4g}, {e[1]:.4g})"
        return {
            "Grid": self.footprint.description,
            "Substrate": str(self.footprint.substrate),
            **self._position_rows(),
            "Force, acting at": f"{self.acting_force:.6g}, {where}",
            "Contact area": f"{self.contact_area:.6g}",
            "Pressure mean": f"{self.mean_pressure:.6g}",
            "Pressure of cells": f"{p.min():.6g} to {p.max():.6g}",
            "Residuals": self._residuals(),
        }

    def _outcome(self) -> dict[str, str]:
        times = ", ".join(f"{k} {v:.3f}" for k, v in self.timings.items())
        return {"Result": self.message, "Time [s]": times}

    def _position_rows(self) -> dict[str, str]:
        """Rows of where the body is."""
        return {}

    def _residuals(self) -> str:
        """How well the equations hold."""
        return f"contact {self.complementarity_residual:.0e}"

    def _on_demand(self) -> dict[str, str]:
        """Rows of what takes a few times the solution: once it is known, or how to have it."""
        return {}

    def __repr__(self) -> str:
        rows = self._rows() | self._on_demand() | self._outcome()
        lines = [f"  {name:<18}{value}" for name, value in rows.items()]
        return "\n".join([f"<skfem_dual {type(self).__name__} object>", *lines])

    def plot(self, **options: Any) -> Any:
        """Isobars of the pressure with the edge of contact, drawn with matplotlib.

        Parameters
        ----------
        **options
            As of `visuals.matplotlib.isobars`: levels, title, labels, cmap, ax.

        Returns
        -------
        Axes
            ``solution.plot().figure.savefig("isobars.svg")`` writes a file.

        Raises
        ------
        ImportError
            If matplotlib is missing.
        TypeError
            If an option is of another kind, or not known.
        ValueError
            If there is no pressure, or the levels do not fit it.
        """
        from ..visuals.matplotlib import isobars

        return isobars(self, **options)

    def _repr_html_(self) -> str:
        from ..visuals.notebook import solution_html

        return solution_html(self)
