"""A rigid punch pressed on a substrate: equations (3)-(5) of the paper."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter
from typing import Literal

import numpy as np
import scipy.linalg
from numpy import ndarray
from scipy.sparse.linalg import LinearOperator, eigsh
from skfem import CellBasis

from ..errors import ConvergenceError
from ..grids.cellwise import CellwiseBasis, nodal_mesh
from ..grids.edge import EdgeWeights, edge_ribs
from ..grids.fan import Fan
from ..grids.partition import Partition
from ..grids.polygons import readonly
from .edge_correction import EdgeCorrection
from .influence import influence_matrix
from .solution import PunchSolution
from .substrates import Substrate

Pair = tuple[float, float]


@dataclass(frozen=True, eq=False, repr=False)
class RigidPunch:
    """A rigid, smooth, flat punch on an elastic substrate.

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
    edge : {"singular", "constant"}
        How the pressure varies inside a cell. ``"singular"``: like the inverse square root of the
        distance to the edge of the plan, as under the edge of a flat punch. ``"constant"``: not
        at all, the paper's scheme, whose settlements are tens of times less accurate.
    edge_boundaries : str or sequence of str, optional
        Names of the boundaries of the mesh that are such an edge; all of them by default. Where
        a punch is rounded off, for example, the pressure does not grow. The mesh is always the
        whole plan: there are no images beyond a line of symmetry.
    collocation : {"centroid", "node"}
        The point of each cell: its centroid, or, with constant pressures only, the node of the
        other grid that belongs to it (the node of the triangulation for dual cells). With
        constant pressures and centroids the settlement comes out too large, with nodes of dual
        cells too small.
    origin : pair of float
        The centre of the punch, to which settlement, force and moments refer.

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
    edge: Literal["singular", "constant"] = "singular"
    edge_boundaries: str | Sequence[str] | None = None
    collocation: Literal["centroid", "node"] = "centroid"
    origin: Pair = (0.0, 0.0)
    timings: dict[str, float] = field(default_factory=dict, init=False)

    def __post_init__(self):
        if isinstance(self.substrate, type) or not hasattr(self.substrate, "remainder"):
            raise TypeError(f"expected a substrate such as HalfSpace, got {self.substrate!r}")
        if self.collocation not in ("centroid", "node"):
            raise ValueError(
                f'expected collocation "centroid" or "node", got {self.collocation!r}'
            )
        if self.edge not in ("singular", "constant"):
            raise ValueError(f'expected edge "singular" or "constant", got {self.edge!r}')
        if self.edge == "singular" and self.collocation == "node":
            raise ValueError(
                'expected collocation "centroid" with edge "singular", got "node". Remedy: '
                'edge="constant" for the paper\'s scheme'
            )
        if self.edge == "constant" and self.edge_boundaries is not None:
            raise ValueError('expected edge "singular" where edge_boundaries are named')
        object.__setattr__(self, "origin", _pair("origin", self.origin))
        self.weights  # noqa: B018 - a basis that cannot be used is refused now

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
        return EdgeWeights(partition, self.fan, ribs)

    def _named_facets(self) -> ndarray:
        names = self.edge_boundaries
        if not isinstance(names, (str, Sequence)):
            raise TypeError(f"expected names for edge_boundaries, got {names!r}")
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

    @cached_property
    def matrix(self) -> ndarray:
        """Settlement of each collocation point under unit pressure on each cell, d_ij of (5)."""
        with self._timed("assembly"):
            x = self.collocation_points
            matrix = influence_matrix(self.substrate, self.partition, x, self.weights)
            if correction := self.edge_correction(x):
                correction.add_to(matrix)
            return matrix

    def edge_correction(self, x: ndarray) -> EdgeCorrection | None:
        """What the variation of the pressure inside the cells adds to settlements at ``x``."""
        if self.weights is None:
            return None
        return EdgeCorrection.from_weights(self.weights, self.substrate.singular_coefficient, x)

    @cached_property
    def _factors(self) -> tuple[ndarray, ndarray]:
        matrix = self.matrix
        with self._timed("factorisation"):
            return scipy.linalg.lu_factor(matrix)

    @cached_property
    def _centre(self) -> ndarray:
        """Centroid of the plan, about which all is computed: no cancellation far from it."""
        areas = self.partition.areas
        return self.partition.centroids @ areas / areas.sum()

    def _planes(self, x: ndarray) -> ndarray:
        """Settlement at ``x`` by unit settlement of the plan's centroid and unit tilts."""
        return np.vstack([np.ones(x.shape[1]), x - self._centre[:, None]])

    @cached_property
    def _unit_pressures(self) -> ndarray:
        """Pressures under unit settlement of the plan's centroid and unit tilts, shape (n, 3)."""
        return scipy.linalg.lu_solve(self._factors, self._planes(self.collocation_points).T)

    @cached_property
    def _resultants(self) -> ndarray:
        """Force and first moments about the plan's centroid of unit pressures, shape (3, n)."""
        acting = self.partition.centroids if self.weights is None else self.weights.centroids
        return self._planes(acting) * self.partition.areas

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
        shift[0, 1:] = self._centre - self.origin
        return shift.T @ (self._resultants @ self._unit_pressures) @ shift

    @cached_property
    def condition_number(self) -> float:
        """Condition number of the matrix in the 2-norm, the paper's degree of conditionality."""
        matrix, factors = self.matrix, self._factors

        def largest(product) -> float:
            gram = LinearOperator(matrix.shape, matvec=product, dtype=float)
            # fixed start: the same digits in every run
            start = np.random.default_rng(0).standard_normal(len(matrix))
            return float(eigsh(gram, k=1, tol=1e-8, v0=start, return_eigenvectors=False)[0])

        if len(matrix) < 3:  # too small for Lanczos
            return float(np.linalg.cond(matrix))
        scale = np.abs(matrix).max()  # in any units
        scaled = matrix / scale

        def inverse(v, trans=0):
            return scale * scipy.linalg.lu_solve(factors, v, trans=trans)

        top = largest(lambda v: scaled.T @ (scaled @ v))
        bottom = largest(lambda v: inverse(inverse(v, trans=1)))
        return float(np.sqrt(top * bottom))

    def solve(
        self,
        force: float | None = None,
        at: Pair | None = None,
        moments: Pair | None = None,
        *,
        settlement: float | None = None,
        tilt: Pair | None = None,
        unilateral: Literal[False] = False,
    ) -> "PunchSolution":
        """Pressures and position of the punch under a load, in a position, or a mixture of both.

        Parameters
        ----------
        force : float
            Vertical force P, positive into the ground. Not together with ``settlement``.
        at : pair of float
            Where the force acts, (epsilon_x, epsilon_y) from ``origin``; default (0, 0).
        moments : pair of float
            M1, M2 of (4): the first moments of the pressure are ``P epsilon_x - M1`` and
            ``P epsilon_y + M2``; default (0, 0). Not together with ``tilt``.
        settlement : float
            Settlement W0 of the origin instead of the force, positive into the ground.
        tilt : pair of float
            Inclinations Lx, Ly instead of the moments. With ``force`` the punch is guided; with
            ``settlement`` its position is given wholly. A given settlement alone leaves the
            punch free to tilt under the reaction, which acts ``at`` the given point.
        unilateral : False
            Contact is bilateral: the ground may pull where the load would lift the punch off;
            the solution's message says where.

        Returns
        -------
        PunchSolution

        Raises
        ------
        ValueError
            If the load is incomplete, contradictory or not finite.
        ConvergenceError
            If the system of equations is singular.
        """
        if unilateral:
            raise ValueError(
                "expected unilateral=False, the only choice of this version: contact is "
                "bilateral, and the solution's message tells where the ground would pull"
            )
        if (force is None) == (settlement is None):
            raise ValueError(
                "expected either a force or a settlement, got "
                + ("neither" if force is None else "both")
            )
        if tilt is not None and (at is not None or moments is not None):
            raise ValueError("expected either a tilt or a load point with moments, got both")
        lever = np.array(_pair("at", (0.0, 0.0) if at is None else at))
        m1, m2 = _pair("moments", (0.0, 0.0) if moments is None else moments)

        unit_pressures = self._unit_pressures
        start = perf_counter()
        # three equations for the settlement of the plan's centroid and the tilts: force or
        # settlement of the origin, moments about the point of the force or tilts
        stiffness = self._resultants @ unit_pressures
        equations, given = np.eye(3), np.empty(3)
        if force is not None:
            equations[0], given[0] = stiffness[0], _number("force", force)
        else:
            equations[0, 1:] = self.origin - self._centre
            given[0] = _number("settlement", settlement)
        if tilt is not None:
            given[1:] = _pair("tilt", tilt)
        else:
            arm = self.origin + lever - self._centre
            with np.errstate(over="ignore"):  # refused below
                equations[1:] = stiffness[1:] - np.outer(arm, stiffness[0])
            given[1:] = -m1, m2
        position = _solve_scaled(equations, given, np.sqrt(self.partition.areas.sum()))

        pressure = unit_pressures @ position
        resultant = self._resultants @ pressure
        shift = self._centre - self.origin
        resultant[1:] += resultant[0] * shift
        imposed = resultant.copy()
        if force is not None:
            imposed[0] = force
        if tilt is None:
            imposed[1:] = imposed[0] * lever + np.array([-m1, m2])
        planes = position @ self._planes(self.collocation_points)
        mismatch = np.abs(self.matrix @ pressure - planes).max()
        if not (np.isfinite(pressure).all() and np.isfinite(resultant).all()):
            raise ConvergenceError("the load is too large for floating-point numbers")
        pulled = int(np.sum(pressure < 0))
        return PunchSolution(
            punch=self,
            pressure=readonly(pressure),
            settlement=float(position[0] - position[1:] @ shift),
            tilt=readonly(position[1:]),
            resultant=readonly(resultant),
            resultant_residual=readonly(resultant - imposed),
            displacement_residual=float(mismatch),
            success=True,
            message="full contact"
            + (f"; the ground would have to pull on {pulled} cells" if pulled else ""),
            timings=self.timings | {"solution": perf_counter() - start},
        )

    @contextmanager
    def _timed(self, what: str) -> Iterator[None]:
        start = perf_counter()
        yield
        self.timings[what] = perf_counter() - start

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


def _solve_scaled(equations: ndarray, given: ndarray, size: float) -> ndarray:
    """Solve for a settlement and two tilts, with rows and columns brought to one unit.

    ``size`` is a length of the plan.
    """
    columns = np.array([1.0, 1 / size, 1 / size])
    scaled = equations * columns
    rows = np.abs(scaled).max(axis=1, keepdims=True)
    if not np.isfinite(scaled).all() or not rows.all() or np.linalg.cond(scaled / rows) > 1e13:
        raise ConvergenceError(
            "the punch can move without resistance; likely cause: a plan of a few cells on one "
            "line, cells on top of each other, or a load or origin extremely far away. Remedy: "
            "use at least three cells that do not lie on one line"
        )
    return columns * np.linalg.solve(scaled / rows, given / rows[:, 0])


def _number(name: str, value) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"expected a number for {name}, got {value!r}") from None
    if not np.isfinite(number):
        raise ValueError(f"expected a finite {name}, got {number}")
    return number


def _pair(name: str, value) -> Pair:
    try:
        x, y = value
    except (TypeError, ValueError):
        raise TypeError(f"expected two numbers for {name}, got {value!r}") from None
    return _number(name, x), _number(name, y)
