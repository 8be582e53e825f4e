"""A rigid punch pressed on a substrate: equations (3)-(5) of the paper."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from time import perf_counter
from typing import Literal

import numpy as np
from numpy import ndarray
from skfem import CellBasis

from ..elements.edge_correction import EdgeCorrection
from ..elements.edge_weights import EdgeWeights
from ..elements.influence import influence_matrix
from ..errors import ConvergenceError, ConvergenceWarning
from ..grids.cellwise import CellwiseBasis, nodal_mesh
from ..grids.fan import Fan
from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..ground.substrates import Substrate
from ..operators.blocks import SymmetricMatrix
from ..operators.influence_operator import InfluenceOperator
from ..operators.symmetry import Symmetry
from .kern import kern
from .load import Load, Pair, checked_number, checked_pair, require_compression
from .shapes import Gap, gap_values
from .solution import TINY, PunchSolution
from .system import DENSE, ContactSystem, Method, timed
from .unilateral import Contact


@dataclass(frozen=True, eq=False, repr=False)
class RigidPunch:
    """A rigid, smooth punch on an elastic substrate, flat or shaped.

    The unknowns are the mean pressures of the cells of a partition, and the displacement of the
    ground equals that of the punch in one point of every cell. Matrix and factors are computed
    once and serve any number of loads.

    Parameters
    ----------
    substrate : HalfSpace, GradedHalfSpace or LayeredHalfSpace
        The ground.
    basis : CellwiseBasis or CellBasis
        Piecewise constants on the plan of the punch: ``dual.basis()``, ``dual.primal_basis()``,
        ``CellBasis(mesh, ElementTriP0())`` or ``CellBasis(mesh, ElementQuad0())``.
    edge : {"singular", "constant"}, optional
        How the pressure varies inside a cell. ``"singular"``, the default of flat punches: like
        the inverse square root of the distance to the edge of the plan, as under the edge of a
        flat punch. ``"constant"``, the default of shaped ones, whose contact ends inside: not at
        all, the paper's scheme, whose settlements of flat punches are tens of times less
        accurate.
    edge_boundaries : str, sequence of str or array of int, optional
        The boundaries of the mesh that are such an edge, by their names or as facets; all of
        them by default. Where a punch is rounded off, for example, the pressure does not grow.
        The mesh is always the whole plan: there are no images beyond a line of symmetry.
    collocation : {"centroid", "node"}
        The point of each cell: its centroid, or, with constant pressures only, the node of the
        other grid that belongs to it (the node of the triangulation for dual cells). With
        constant pressures and centroids the settlement comes out too large, with nodes of dual
        cells too small.
    origin : pair of float
        The centre of the punch, to which settlement, force and moments refer.
    gap : callable, array or (CellBasis, vector), optional
        Shape of a punch that is not flat: its distance from the ground before they press on each
        other, positive where there is a slot. A function of coordinates of shape (2, n) from
        the coordinates' origin, such as those of `shapes`; one value for each collocation point;
        or a field of scikit-fem.
    rtol : float, optional
        Accuracy of the settlements under given pressures, see `InfluenceOperator`: far cells
        are summed up. By default exact and dense up to 4000 cells, 1e-6 and whatever is fastest
        beyond. Fast operators are solved by iterations.
    symmetry : "auto" or Symmetry, optional
        Mirror lines and rotations of the plan and its mesh, found or given: the matrix needs one
        row of each orbit of cells and is solved in independent blocks. ``print(symmetry)`` tells
        the saving. The load need not be symmetric.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
    >>> punch = RigidPunch(HalfSpace(young=1.0, poisson=0.25), dual.basis())
    >>> solution = punch.solve(force=1.0)
    >>> print(f"{solution.settlement:.3f}")  # exact for the circle: 0.46875
    0.469
    """

    substrate: Substrate
    basis: CellBasis
    edge: Literal["singular", "constant"] | None = None
    edge_boundaries: str | Sequence[str] | ndarray | None = None
    collocation: Literal["centroid", "node"] = "centroid"
    origin: Pair = (0.0, 0.0)
    gap: Gap | None = None
    rtol: float | None = None
    symmetry: Literal["auto"] | Symmetry | None = None
    timings: dict[str, float] = field(default_factory=dict, init=False)

    def __post_init__(self):
        if isinstance(self.substrate, type) or not hasattr(self.substrate, "remainder"):
            raise TypeError(f"expected a substrate such as HalfSpace, got {self.substrate!r}")
        if self.collocation not in ("centroid", "node"):
            raise ValueError(
                f'expected collocation "centroid" or "node", got {self.collocation!r}'
            )
        if self.edge is None:
            flat = self.gap is None
            object.__setattr__(self, "edge", "singular" if flat else "constant")
        if self.edge not in ("singular", "constant"):
            raise ValueError(f'expected edge "singular" or "constant", got {self.edge!r}')
        if self.edge == "singular" and self.collocation == "node":
            raise ValueError(
                'expected collocation "centroid" with edge "singular", got "node". Remedy: '
                'edge="constant" for the paper\'s scheme'
            )
        if self.edge == "constant" and self.edge_boundaries is not None:
            raise ValueError('expected edge "singular" where edge_boundaries are named')
        object.__setattr__(self, "origin", checked_pair("origin", self.origin))
        if self.rtol is not None and not 0 <= checked_number("rtol", self.rtol) <= 1e-2:
            raise ValueError(f"expected a tolerance from 0 to 0.01, got rtol={self.rtol}")
        if not (self.symmetry in (None, "auto") or isinstance(self.symmetry, Symmetry)):
            raise TypeError(f'expected symmetry "auto" or a Symmetry, got {self.symmetry!r}')
        self.weights  # noqa: B018 - a basis that cannot be used is refused now
        self.initial_gap  # noqa: B018 - and so is a shape

    def __getstate__(self) -> dict:
        """What makes the punch; matrix and factors, many times larger, are computed again."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @cached_property
    def partition(self) -> Partition:
        """The cells, in the order of the DOFs of the basis."""
        return Partition.from_basis(self.basis)

    @cached_property
    def fan(self) -> Fan:
        """Triangles that fill the cells."""
        return Fan.from_basis(self.basis)

    @cached_property
    def weights(self) -> EdgeWeights | None:
        """How the pressure varies inside the cells; None if it does not."""
        partition = self.partition  # also where it is not needed: a bad basis is refused now
        if self.edge == "constant":
            return None
        ribs = edge_ribs(partition)
        if self.edge_boundaries is not None:
            ribs = ribs[np.isin(partition.boundary[ribs], self._named_facets())]
            if len(ribs) == 0:
                raise ValueError(
                    f"expected boundaries with facets on the edge of the plan, got "
                    f'{self.edge_boundaries!r}. Remedy: edge="constant" if there is no such edge'
                )
        return EdgeWeights.from_basis(self.basis, partition, ribs)

    def _named_facets(self) -> ndarray:
        names = self.edge_boundaries
        if isinstance(names, np.ndarray) and np.issubdtype(names.dtype, np.integer):
            return names
        if not isinstance(names, (str, Sequence)):
            raise TypeError(f"expected names or facets for edge_boundaries, got {names!r}")
        names = [names] if isinstance(names, str) else list(names)
        known = nodal_mesh(self.basis).boundaries or {}
        if missing := [name for name in names if name not in list(known)]:
            raise ValueError(
                f"expected names of boundaries of the mesh, {sorted(known)}, got {missing}"
            )
        return np.concatenate([np.empty(0), *(known[name] for name in names)])

    @property
    def collocation_points(self) -> ndarray:
        """Collocation point of each cell, shape (2, n)."""
        at_nodes = self.collocation == "node"
        return self.partition.nodes if at_nodes else self.partition.centroids

    @property
    def acting(self) -> ndarray:
        """Point through which the pressure of each cell acts, shape (2, n)."""
        return self.partition.centroids if self.weights is None else self.weights.centroids

    @cached_property
    def matrix(self) -> ndarray:
        """Settlement of each collocation point under unit pressure on each cell, d_ij of (5)."""
        with timed(self.timings, "assembly"):
            return self.influence(self.collocation_points)

    @cached_property
    def operator(self) -> ndarray | SymmetricMatrix | InfluenceOperator:
        """The matrix, or what stands for it: its blocks, or a fast summation to the tolerance."""
        x, n = self.collocation_points, len(self.partition)
        if (symmetry := self._symmetry) is not None:
            with timed(self.timings, "assembly"):
                return SymmetricMatrix.from_rows(
                    symmetry, lambda i: self.influence(np.ascontiguousarray(x[:, i]))
                )
        if self.rtol is None and n <= DENSE:
            return self.matrix
        rtol = 1e-6 if self.rtol is None else self.rtol
        with timed(self.timings, "assembly"):
            found = InfluenceOperator.of_cells(
                self.substrate, self.partition, x, self.weights, rtol
            )
        few = n <= DENSE and found.method == "dense"
        return found.to_dense() if few else found

    def influence(self, x: ndarray) -> ndarray:
        """Settlement of points of shape (2, m) under unit pressure on each cell, (m, n)."""
        matrix = influence_matrix(self.substrate, self.partition, x, self.weights)
        if correction := self.edge_correction(x):
            correction.add_to(matrix)
        return matrix

    @cached_property
    def _symmetry(self) -> Symmetry | None:
        """The symmetry to be used; None if there is none, or too little for so many cells."""
        n, found = len(self.partition), self.symmetry
        if found is None:
            return None
        if isinstance(found, Symmetry):
            if len(found) != n:
                raise ValueError(
                    f"expected a symmetry of the {n} cells of the punch, got one of {len(found)}"
                )
            return found
        found = Symmetry.detect(self.partition, self.collocation_points, self.weights)
        small = n**2 <= DENSE**2 * found.saving.memory
        return found if len(found.permutations) > 1 and small else None

    def edge_correction(self, x: ndarray) -> EdgeCorrection | None:
        """What the variation of the pressure inside the cells adds to settlements at ``x``."""
        if self.weights is None:
            return None
        return EdgeCorrection.from_weights(self.weights, self.substrate.singular_coefficient, x)

    @cached_property
    def initial_gap(self) -> ndarray:
        """Gap between punch and ground in the collocation points before contact."""
        x = self.collocation_points
        return readonly(np.zeros(x.shape[1]) if self.gap is None else gap_values(self.gap, x))

    @cached_property
    def system(self) -> ContactSystem:
        """The equations for pressures and the position of the plan's centroid."""
        return ContactSystem(
            self.operator,
            self.planes(self.collocation_points),
            self.resultants,
            self.initial_gap,
            self.partition.areas,
            self.timings,
        )

    @cached_property
    def centre(self) -> ndarray:
        """Centroid of the plan, about which all is computed: no cancellation far from it."""
        areas = self.partition.areas
        return self.partition.centroids @ areas / areas.sum()

    def planes(self, x: ndarray) -> ndarray:
        """Settlement at ``x`` by unit settlement of the plan's centroid and unit tilts."""
        return np.vstack([np.ones(x.shape[1]), x - self.centre[:, None]])

    @cached_property
    def resultants(self) -> ndarray:
        """Force and first moments about the plan's centroid of unit pressures, shape (3, n)."""
        return self.planes(self.acting) * self.partition.areas

    def stiffness(self) -> ndarray:
        """Force and moments by unit settlement and unit tilts, shape (3, 3).

        Returns
        -------
        (3, 3) array of float
            Maps ``(W0, Lx, Ly)`` of (3) to the integrals of ``p``, ``p x`` and ``p y`` with the
            coordinates from ``origin``. Symmetric up to the error of the discretisation.

        Examples
        --------
        >>> from skfem import MeshTri
        >>> from skfem_dual import DualMesh, HalfSpace
        >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
        >>> K = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).stiffness()
        >>> [round(float(k), 2) for k in K.diagonal()]  # exact for the circle: 2, 4/3, 4/3
        [2.0, 1.33, 1.33]
        """
        shift = np.eye(3)
        shift[0, 1:] = self.centre - self.origin
        return shift.T @ self.system.stiffness @ shift

    def kern(self) -> ndarray:
        """Where a force may act without the punch lifting off.

        Returns
        -------
        (2, k) array of float
            Vertices of a convex polygon, counter-clockwise, from ``origin``.

        Raises
        ------
        ValueError
            If the punch is not flat: it lifts off depending on the force.
        ConvergenceError
            If pure settlement does not press on every cell; improve the mesh.

        Examples
        --------
        A third of the radius of a circle:

        >>> from skfem import MeshTri
        >>> from skfem_dual import DualMesh, HalfSpace
        >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
        >>> corners = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).kern()
        >>> print(f"{np.hypot(*corners).mean():.2f}")
        0.33
        """
        if self.gap is not None:
            raise ValueError(
                "expected a flat punch, got one with a gap, whose contact depends on the force"
            )
        found = kern(self.system, self.partition, self.acting, self.centre)
        return readonly(found - np.array(self.origin)[:, None])

    @property
    def condition_number(self) -> float:
        """Condition number of the matrix in the 2-norm.

        The paper does not say what its degree of conditionality is. It prints 274.0 for the
        uniform polar grid of Table 1, where this number is 246.9; that of the matrix with its
        rows scaled to sums of one comes nearest, 275.4.
        """
        return self.system.condition_number

    def solve(
        self,
        force: float | None = None,
        at: Pair | None = None,
        moments: Pair | None = None,
        *,
        settlement: float | None = None,
        tilt: Pair | None = None,
        unilateral: bool = True,
        method: Method = "auto",
        start: PunchSolution | None = None,
        rtol: float = 1e-10,
        progress: bool = False,
    ) -> PunchSolution:
        """Pressures and position of the punch under a load, in a position, or a mixture of both.

        Parameters
        ----------
        force, at, moments, settlement, tilt
            What is imposed; see `Load`.
        unilateral : bool
            Whether the contact region is found: the ground does not pull, and the punch lifts
            off where it would. If not, all cells stay in contact, the paper's (5).
        method : {"auto", "active-set", "cg"}
            How the contact region is found: a primal-dual active set; projected conjugate
            gradients, whose time grows with the square of the number of cells; or, by default,
            these, polished by a direct solution where that is cheap.
        start : PunchSolution, optional
            A solution nearby to begin with, on any grid.
        rtol : float
            Accuracy of the gaps in contact under conjugate gradients, over the largest
            settlement.
        progress : bool
            Whether iterations show progress bars.

        Returns
        -------
        PunchSolution
            With ``success=False`` and a `ConvergenceWarning` if the contact region was not found.

        Raises
        ------
        ValueError
            If the load is incomplete, contradictory or not finite, or if no pressures can
            balance it: tension, moments without a force, or a resultant beyond the plan.
        ConvergenceError
            If the system of equations is singular.
        """
        load = Load(force, at, moments, settlement, tilt)
        if unilateral:
            corners, o = self.partition.polygons.p, np.array(self.origin)[:, None]
            require_compression(load, self.acting - o, corners - o, self.gap is None)
        system, centre = self.system, self.centre
        constraints = load.constraints(self.origin - centre)
        begin = perf_counter()
        if start is None and self.gap is None:
            system.prepare(progress)
        with np.errstate(over="ignore", invalid="ignore"):  # refused below
            if unilateral:
                pressures = None if start is None else self.pressures_of(start)
                contact, position = system.unilateral(
                    constraints, method, pressures, rtol, progress
                )
            else:
                contact, position = system.bilateral(constraints)
            if not (np.isfinite(contact.pressure).all() and np.isfinite(position).all()):
                raise ConvergenceError("the load is too large for floating-point numbers")
        return self.solution(load, contact, position, {"solution": perf_counter() - begin})

    def solution(
        self,
        load: Load,
        contact: Contact,
        position: ndarray,
        timings: dict[str, float],
        others: tuple[tuple["RigidPunch", ndarray], ...] = (),
    ) -> PunchSolution:
        """The answer, from contact and position of the plan's centroid.

        ``others`` are the punches beside it, with their pressures.
        """
        pressure, shift = contact.pressure, self.centre - self.origin
        resultant = self.resultants @ pressure
        resultant[1:] += resultant[0] * shift
        imposed = resultant.copy()
        if load.force is not None:
            imposed[0] = load.force
        if load.tilt is None:
            imposed[1:] = imposed[0] * np.array(load.at or (0.0, 0.0)) + load.first_moments
        # what the ground settles is what remains of the gap, less the punch's shape and motion
        settled = contact.gap - self.initial_gap + position @ self.planes(self.collocation_points)
        if not contact.success:
            warnings.warn(contact.message, ConvergenceWarning, stacklevel=3)
        return PunchSolution(
            punch=self,
            load=load,
            pressure=readonly(pressure),
            gap=readonly(np.where(contact.touching, 0.0, contact.gap.clip(0))),
            settlement=float(position[0] - position[1:] @ shift),
            tilt=readonly(position[1:]),
            resultant=readonly(resultant),
            resultant_residual=readonly(resultant - imposed),
            displacement_residual=contact.violation,
            complementarity_residual=max(
                contact.pulling, contact.violation / max(np.abs(settled).max(), TINY)
            ),
            iterations=len(contact.history),
            success=contact.success,
            message=contact.message or _describe(contact),
            timings=self.timings | timings,
            others=others,
        )

    def pressures_of(self, start: PunchSolution) -> ndarray:
        """Pressures of the cells in a solution of any punch."""
        if not isinstance(start, PunchSolution):
            raise TypeError(f"expected a PunchSolution for start, got {type(start).__name__}")
        if start.punch.basis is self.basis:
            return start.pressure.clip(0)
        found = start.pressure_at(self.partition.centroids)
        return np.where(np.isfinite(found), found, 0.0).clip(0)

    def __repr__(self) -> str:
        return (
            f"<skfem_dual RigidPunch object>\n  Substrate: {self.substrate}\n"
            f"  Grid: {self.grid_description}"
        )

    @property
    def grid_description(self) -> str:
        """Number and kind of the cells and the collocation, for tables."""
        if isinstance(self.basis, CellwiseBasis) and self.basis.grid == "dual":
            kind = "dual cells"
        else:
            corners = set(self.partition.polygons.sizes.tolist())
            kind = {3: "triangles", 4: "quadrilaterals"}[corners.pop()]
        return f"{len(self.partition)} {kind}, {self.edge} edge, {self.collocation} collocation"


def _describe(contact: Contact) -> str:
    touching, pulled = contact.touching, int(np.sum(contact.pressure < 0))
    if not touching.any():
        return "no contact"
    if not touching.all():
        return f"contact on {touching.sum()} of {len(touching)} cells"
    also = f"; the ground would have to pull on {pulled} cells" if pulled else ""
    return "full contact" + also
