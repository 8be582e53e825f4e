"""A rigid punch pressed on a substrate: equations (3)-(5) of the paper."""

from collections.abc import Iterator
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
from ..grids.cellwise import CellwiseBasis, nodal_values
from ..grids.partition import Partition
from ..grids.polygons import readonly
from .influence import influence_matrix, surface_displacement
from .substrates import HalfSpace

Pair = tuple[float, float]

#: up to so many cells a printed solution tells the condition number, in a few milliseconds
REPR_CONDITION = 2000


@dataclass(frozen=True, eq=False, repr=False)
class RigidPunch:
    """A rigid, smooth, flat punch on an elastic substrate.

    The contact pressure is constant on the cells of a partition, and the displacement of the
    ground equals that of the punch in one point of every cell. Matrix and factors are computed
    once and serve any number of loads.

    Parameters
    ----------
    substrate : HalfSpace
        The ground.
    basis : CellwiseBasis or CellBasis
        Piecewise constants on the plan of the punch: ``dual.basis()``, ``dual.primal_basis()``,
        ``CellBasis(mesh, ElementTriP0())`` or ``CellBasis(mesh, ElementQuad0())``.
    collocation : {"centroid", "node"}
        The point of each cell: its centroid, or the node of the other grid that belongs to it
        (the node of the triangulation for dual cells). With centroids the settlement comes out
        too large, with nodes of dual cells too small.
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
    0.473
    """

    substrate: HalfSpace
    basis: CellBasis
    collocation: Literal["centroid", "node"] = "centroid"
    origin: Pair = (0.0, 0.0)
    timings: dict[str, float] = field(default_factory=dict, init=False)

    def __post_init__(self):
        if not hasattr(self.substrate, "influence"):
            raise TypeError(
                f"expected a substrate such as HalfSpace, got {type(self.substrate).__name__}"
            )
        if self.collocation not in ("centroid", "node"):
            raise ValueError(
                f'expected collocation "centroid" or "node", got {self.collocation!r}'
            )
        object.__setattr__(self, "origin", _pair("origin", self.origin))
        self.partition  # noqa: B018 - a basis that cannot be used is refused now

    @cached_property
    def partition(self) -> Partition:
        """The cells, in the order of the DOFs of the basis."""
        return Partition.from_basis(self.basis)

    @property
    def collocation_points(self) -> ndarray:
        """Collocation point of each cell, shape (2, n)."""
        at_nodes = self.collocation == "node"
        return self.partition.nodes if at_nodes else self.partition.centroids

    @cached_property
    def matrix(self) -> ndarray:
        """Settlement of each collocation point under unit pressure on each cell, d_ij of (5)."""
        with self._timed("assembly"):
            return influence_matrix(self.substrate, self.partition, self.collocation_points)

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
        return self._planes(self.partition.centroids) * self.partition.areas

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
        >>> from skfem_dual import DualMesh
        >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
        >>> K = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).stiffness()
        >>> [round(float(k), 2) for k in K.diagonal()]  # exact for the circle: 2, 4/3, 4/3
        [1.98, 1.3, 1.3]
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
        top = largest(lambda v: matrix.T @ (matrix @ v))
        bottom = largest(
            lambda v: scipy.linalg.lu_solve(factors, scipy.linalg.lu_solve(factors, v, trans=1))
        )
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
            equations[1:] = stiffness[1:] - np.outer(arm, stiffness[0])
            given[1:] = -m1, m2
        position = _solve_scaled(equations, given)

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
        return f"{len(self.partition)} {kind}, {self.collocation} collocation"


@dataclass(frozen=True, eq=False, repr=False)
class PunchSolution:
    """Pressures under a punch and its position.

    Attributes
    ----------
    punch : RigidPunch
        The problem solved.
    pressure : (n,) array of float
        Mean pressure on each cell, compression positive; a vector of ``punch.basis``.
    settlement : float
        Settlement W0 of ``punch.origin``, positive into the ground.
    tilt : (2,) array of float
        Inclinations (Lx, Ly): the punch settles by ``W0 + Lx x + Ly y``, from the origin.
    resultant : (3,) array of float
        Integrals of ``p``, ``p x`` and ``p y``, from the origin.
    resultant_residual : (3,) array of float
        Resultant minus the imposed load; zero where a position was imposed.
    displacement_residual : float
        Largest difference of the displacements of ground and punch in a collocation point.
    success : bool
        Whether the equations were solved.
    message : str
        What was found.
    timings : dict of str to float
        Seconds of assembly, factorisation and solution.
    """

    punch: RigidPunch
    pressure: ndarray
    settlement: float
    tilt: ndarray
    resultant: ndarray
    resultant_residual: ndarray
    displacement_residual: float
    success: bool
    message: str
    timings: dict[str, float]

    @property
    def force(self) -> float:
        """Resultant of the pressure."""
        return float(self.resultant[0])

    @property
    def centre_of_pressure(self) -> ndarray:
        """Point through which the resultant acts, from the origin; NaN without a force."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.resultant[1:] / self.resultant[0]

    @property
    def contact_area(self) -> float:
        """Area of the cells in contact; contact is bilateral, so of the whole plan."""
        return float(self.punch.partition.areas.sum())

    @property
    def mean_pressure(self) -> float:
        """Force over contact area."""
        return self.force / self.contact_area

    @property
    def condition_number(self) -> float:
        """Condition number of the matrix in the 2-norm; computed when asked for."""
        return self.punch.condition_number

    def displacement(self, x) -> ndarray:
        """Settlement of the ground at any points of its surface.

        Parameters
        ----------
        x : (2, m) array of float
            Points under the punch or beside it.

        Returns
        -------
        (m,) array of float
            Positive into the ground.
        """
        return surface_displacement(self.punch.substrate, self.punch.partition, self.pressure, x)

    def punch_displacement(self, x) -> ndarray:
        """Settlement ``W0 + Lx x + Ly y`` of the punch at points of shape (2, m)."""
        x = np.asarray(x, dtype=float)
        return self.settlement + self.tilt @ (x - np.array(self.punch.origin)[:, None])

    def nodal_pressure(self) -> tuple[CellBasis, ndarray]:
        """Pressure at the nodes of the mesh, linear inside each triangle (Section 4.2).

        On dual cells the nodal values are those of the cells. On triangles and quadrilaterals
        they are the means over the cells around the node, weighted by area. Boundary nodes stand
        for the mean pressure of their cells, finite where the exact pressure is not.

        Returns
        -------
        basis : CellBasis
            First-order basis on the mesh.
        values : (N,) array of float
            Its vector.
        """
        return nodal_values(self.punch.basis, self.pressure)

    def table(self) -> list[tuple[str, str]]:
        """Names and values of the rows of ``repr``."""
        p, scale = self.pressure, max(abs(self.settlement), np.finfo(float).tiny)
        load = np.abs(self.resultant).max()
        residual = np.abs(self.resultant_residual).max() / load if load > 0 else 0.0
        e = self.centre_of_pressure
        return [
            ("Grid", self.punch.grid_description),
            ("Substrate", str(self.punch.substrate)),
            ("Settlement W0", f"{self.settlement:.6g}"),
            ("Tilt (Lx, Ly)", f"({self.tilt[0]:.6g}, {self.tilt[1]:.6g})"),
            ("Force, acting at", f"{self.force:.6g}, ({e[0]:.4g}, {e[1]:.4g})"),
            ("Contact area", f"{self.contact_area:.6g}"),
            ("Pressure mean", f"{self.mean_pressure:.6g}"),
            ("Pressure min, max", f"{p.min():.6g}, {p.max():.6g}"),
            (
                "Residuals",
                f"load {residual:.0e}, displacement {self.displacement_residual / scale:.0e}",
            ),
            ("Result", self.message),
            ("Time [s]", ", ".join(f"{k} {v:.3f}" for k, v in self.timings.items())),
        ]

    def __repr__(self) -> str:
        rows = self.table()
        if len(self.pressure) <= REPR_CONDITION:
            rows.insert(-2, ("Condition number", f"{self.condition_number:.4g}"))
        lines = [f"  {name:<18}{value}" for name, value in rows]
        return "\n".join(["<skfem_dual PunchSolution object>", *lines])


def _solve_scaled(equations: ndarray, given: ndarray) -> ndarray:
    """Solve a small system after scaling its rows, which have different units."""
    rows = np.abs(equations).max(axis=1, keepdims=True)
    try:
        return np.linalg.solve(equations / rows, given / rows[:, 0])
    except np.linalg.LinAlgError:
        raise ConvergenceError(
            "the punch can move without resistance; likely cause: a plan of a few cells on one "
            "line. Remedy: use at least three cells that do not lie on one line"
        ) from None


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
