"""Settlements under pressures on cells as a linear operator, dense or fast."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import Literal

import numpy as np
from numpy import ndarray
from scipy.sparse.linalg import LinearOperator
from skfem import CellBasis

from ..elements.edge_correction import EdgeCorrection
from ..elements.edge_weights import EdgeWeights
from ..elements.influence import as_points, influence_matrix
from ..elements.near import NearField
from ..errors import ConvergenceError
from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..ground.substrates import Substrate
from .dense import moment_matrix
from .fmm.summation import SINGLE, FastSummation, order_for

Method = Literal["auto", "dense", "fast"]
#: tolerances below it are for exact entries
EXACT = 1e-8
#: rows that are compared with exact ones
SAMPLES = 16
#: their error in the 2-norm may be so many times the tolerance
ROWS = 10.0
#: tolerance of a first attempt with a remainder beside c / r
REMAINDER = 0.4
#: errors do not refer to less than so many times what homogeneous ground would settle
FLOOR = 0.01


@dataclass(frozen=True)
class Estimate:
    """What an operator will take: bytes, and seconds on two cores."""

    memory: float
    setup: float
    product: float

    def __str__(self) -> str:
        return (
            f"{self.memory / 2**20:.4g} MiB, {self.setup:.2g} s + {self.product:.2g} s a product"
        )


def estimate(method: str, points: int, cells: int, rtol: float, layered: bool) -> Estimate:
    """Estimate of an operator from ``cells`` to ``points``, by what was measured.

    ``layered`` if the influence function has a remainder.
    """
    if method == "dense":
        entries = float(points) * cells
        entry = 8e-9 if rtol < EXACT else 2e-9
        return Estimate(8 * entries, (entry + 12e-9 * layered) * entries, 0.8e-9 * entries)
    order = order_for(rtol)
    terms, size = order * (order + 1) / 2, 4 if rtol >= SINGLE else 8
    each, fields = max(points, cells), 2 if layered else 1
    # near entries and moments of every cell, two expansions and a table for every box; twice the
    # former while they are made
    memory = each * (120.0 * size + fields * (terms * size + 60) + 2 * terms * 1.5 + 500)
    setup = 0.1 * fields + each * (13e-6 + 60e-6 * layered) + each * 2e-8 * terms
    return Estimate(memory, setup, 1e-3 + each * fields * (2e-7 + 1e-8 * terms))


class InfluenceOperator(LinearOperator):
    """Settlements of collocation points under mean pressures of cells, the matrix of (5).

    Parameters
    ----------
    substrate : HalfSpace, GradedHalfSpace or LayeredHalfSpace
        The ground.
    basis : CellwiseBasis or CellBasis
        Piecewise constants, see `RigidPunch`.
    rtol : float
        Error allowed in a settlement, relative to the sum of the contributions of all cells
        taken positive, which is no less than a hundredth of that on homogeneous ground with the
        moduli of the surface. It is verified on some rows. Below 1e-8, for dense matrices only:
        exact entries.
    method : {"auto", "dense", "fast"}
        A matrix, a fast summation in linear time and memory, or what is sooner ready for some
        twenty products and fits into the memory.
    edge : {"singular", "constant"}
        How the pressure varies inside cells, see `RigidPunch`.
    collocation : {"centroid", "node"}
        Where settlements are found.

    Attributes
    ----------
    method : {"dense", "fast"}
        What was chosen.
    estimate : Estimate
        Memory and time expected before the work.
    error : float
        Greatest error found on sampled rows, as ``rtol`` is meant.
    row_error : float
        Error of the sampled rows in the 2-norm, as for pressures of random signs.
    setup_time : float
        Seconds it took.

    Raises
    ------
    MemoryError
        Before the work, if the memory at hand will not do.
    ConvergenceError
        If the fast summation does not reach ``rtol``.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace
    >>> basis = DualMesh.from_mesh(MeshTri.init_circle(4)).basis()
    >>> operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis)
    >>> operator.shape, operator.method
    ((545, 545), 'dense')
    >>> settlement = operator @ np.ones(545)
    """

    def __init__(
        self,
        substrate: Substrate,
        basis: CellBasis,
        rtol: float = 1e-6,
        method: Method = "auto",
        *,
        edge: Literal["singular", "constant"] = "singular",
        collocation: Literal["centroid", "node"] = "centroid",
    ):
        if edge not in ("singular", "constant"):
            raise ValueError(f'expected edge "singular" or "constant", got {edge!r}')
        if collocation not in ("centroid", "node"):
            raise ValueError(f'expected collocation "centroid" or "node", got {collocation!r}')
        partition = Partition.from_basis(basis)
        weights = None
        if edge == "singular":
            weights = EdgeWeights.from_basis(basis, partition, edge_ribs(partition))
        x = partition.nodes if collocation == "node" else partition.centroids
        self._build(substrate, partition, x, weights, rtol, method)

    @classmethod
    def of_cells(
        cls,
        substrate: Substrate,
        partition: Partition,
        x: ndarray,
        weights: EdgeWeights | None = None,
        rtol: float = 1e-6,
        method: Method = "auto",
    ) -> "InfluenceOperator":
        """From cells of a partition to any points of the surface.

        Parameters
        ----------
        substrate, rtol, method
            As for the class.
        partition : Partition
            The loaded cells.
        x : (2, m) array of float
            Field points.
        weights : EdgeWeights, optional
            How the pressure varies inside the cells; not at all by default.
        """
        operator = cls.__new__(cls)
        operator._build(substrate, partition, as_points(x), weights, rtol, method)
        return operator

    def at(self, x: ndarray) -> "InfluenceOperator":
        """From the same cells to other points ``x`` of shape (2, m), to the same tolerance."""
        return self.of_cells(self.substrate, self.partition, x, self.weights, self.rtol)

    def _build(self, substrate, partition, x, weights, rtol, method) -> None:
        if isinstance(substrate, type) or not hasattr(substrate, "remainder"):
            raise TypeError(f"expected a substrate such as HalfSpace, got {substrate!r}")
        if not 0 <= rtol <= 1e-2:
            raise ValueError(f"expected a tolerance from 0 to 0.01, got rtol={rtol}")
        if method not in ("auto", "dense", "fast"):
            raise ValueError(f'expected method "auto", "dense" or "fast", got {method!r}')
        if method == "fast" and rtol < EXACT:
            raise ValueError(
                f"expected a tolerance of at least {EXACT:g} of the fast summation, got {rtol:g}. "
                'Remedy: method="dense"'
            )
        super().__init__(np.dtype(float), (x.shape[1], len(partition)))
        self.substrate, self.partition, self.x, self.weights = substrate, partition, x, weights
        self.rtol = float(rtol)
        self.method, self.estimate = self._choose(method)
        start = perf_counter()
        self.correction = None
        if weights is not None:
            self.correction = EdgeCorrection.from_weights(
                weights, substrate.singular_coefficient, x
            )
        self._matrix = np.empty((0, 0))  # unless it is dense
        self.summation: FastSummation | None = None
        self._reach(self._make_dense if self.method == "dense" else self._make_fast)
        self.setup_time = perf_counter() - start

    def _reach(self, make: Callable[[float], None]) -> None:
        """Make the operator with tolerances from ``rtol`` on down until its error is less."""
        tolerance = self.rtol
        if tolerance >= EXACT and self.substrate.remainder is not None:
            # settlements can be far smaller than those of c / r alone, and errors add up
            least = float(np.min(self._samples[1] / self._alone.sum(axis=1)))
            tolerance *= REMAINDER * min(1.0, least)
        for _ in range(4):
            make(tolerance)
            self.error, self.row_error = self._errors()
            worst = max(self.error, self.row_error / ROWS)
            if worst <= self.rtol or self.rtol < EXACT:
                return
            tolerance *= min(0.5, 0.7 * self.rtol / worst)
            if tolerance < EXACT / 10:
                break
        raise ConvergenceError(
            f"expected an error up to rtol={self.rtol:g}, the {self.method} summation reaches "
            f'{worst:.1e}. Remedy: a larger rtol, or method="dense" with rtol=0'
        )

    def _choose(self, method: str) -> tuple[str, Estimate]:
        layered = self.substrate.remainder is not None
        m, n = self.shape
        found = {
            "dense": estimate("dense", m, n, self.rtol, layered),
            "fast": estimate("fast", m, n, max(self.rtol, EXACT), layered),
        }
        memory = available_memory()
        if method == "auto":
            fits = [
                name
                for name, e in found.items()
                if e.memory <= memory and (name == "dense" or self.rtol >= EXACT)
            ]
            method = min(
                fits or ["fast"], key=lambda name: found[name].setup + 20 * found[name].product
            )
        if found[method].memory > memory:
            remedy = (
                'method="fast" or "auto" with rtol of 1e-8 or more'
                if method == "dense"
                else "a coarser mesh, or a machine with more memory"
            )
            raise MemoryError(
                f"expected at most {memory / 2**20:.4g} MiB, the memory at hand; {method} "
                f"summation from {self.shape[1]} cells to {self.shape[0]} points takes about "
                f"{found[method].memory / 2**20:.4g} MiB. Remedy: {remedy}"
            )
        return method, found[method]

    def _make_dense(self, tolerance: float) -> None:
        arguments = self.substrate, self.partition, self.x, self.weights
        if self.rtol < EXACT:
            matrix = influence_matrix(*arguments)
            if self.correction is not None:
                self.correction.add_to(matrix)
        else:
            matrix = moment_matrix(*arguments, tolerance)
            if self.correction is not None:  # the dipoles are in it
                near = self.correction.near.tocoo()
                matrix[near.row, near.col] += near.data
        matrix.setflags(write=False)
        self._matrix = matrix

    def _make_fast(self, tolerance: float) -> None:
        arguments = self.substrate, self.partition, self.x, self.weights
        self.summation = None  # gives back its memory first
        self.summation = FastSummation.build(*arguments, tolerance)

    @cached_property
    def _sampled(self) -> ndarray:
        m = self.shape[0]
        return np.random.default_rng(0).choice(m, min(SAMPLES, m), replace=False)

    @cached_property
    def _alone(self) -> ndarray:
        """Sampled rows on homogeneous ground with the moduli of the surface."""
        x = np.ascontiguousarray(self.x[:, self._sampled])
        return influence_matrix(self.substrate.surface, self.partition, x)

    @cached_property
    def _samples(self) -> tuple[ndarray, ndarray, ndarray]:
        """Exact rows, and what their errors refer to: sums and 2-norms."""
        exact = self.rows(self._sampled)
        total, norm = np.abs(exact).sum(axis=1), np.linalg.norm(exact, axis=1)
        if self.substrate.remainder is not None:
            total = np.maximum(total, FLOOR * self._alone.sum(axis=1))
            norm = np.maximum(norm, FLOOR * np.linalg.norm(self._alone, axis=1))
        return exact, total, norm

    def _errors(self) -> tuple[float, float]:
        """Errors on sampled rows: under uniform pressure, and in the 2-norm."""
        exact, total, norm = self._samples
        n = self.shape[1]
        signs = np.random.default_rng(0).choice([-1.0, 1.0], (n, 2))
        uniform = (self @ np.ones(n))[self._sampled] - exact.sum(axis=1)
        mixed = (self @ signs)[self._sampled] - exact @ signs
        rows = np.sum(mixed**2, axis=1) / 2 / norm**2
        return float(np.max(np.abs(uniform) / total)), float(np.sqrt(rows.mean()))

    def rows(self, i) -> ndarray:
        """Exact rows of the matrix, of the points with the numbers ``i``; shape (len(i), n)."""
        i = np.atleast_1d(i)
        x = np.ascontiguousarray(self.x[:, i])
        matrix = influence_matrix(self.substrate, self.partition, x, self.weights)
        if (c := self.correction) is not None:
            EdgeCorrection(x, c.centroids, c.near[i], c.dipoles).add_to(matrix)
        return matrix

    def diagonal(self) -> ndarray:
        """Settlement of each cell's own point under unit pressure on it, exact; shape (n,)."""
        m, n = self.shape
        if m != n:
            raise ValueError(f"expected a square operator, got shape {self.shape}")
        each = np.arange(n)
        out = np.empty(n)
        near = NearField.from_partition(self.substrate, self.partition, self.weights, each, EXACT)
        near.fill(self.x, np.stack([each, each + 1]), (np.arange(n + 1), each), out)
        return out if self.correction is None else out + self.correction.near.diagonal()

    def to_dense(self) -> ndarray:
        """The matrix, read-only; made by a dense operator of the same tolerance if need be."""
        if self.summation is None:
            return self._matrix
        arguments = self.substrate, self.partition, self.x, self.weights
        return self.of_cells(*arguments, self.rtol, "dense").to_dense()

    @property
    def memory(self) -> int:
        """Bytes that are kept."""
        near = self.correction.near if self.correction is not None else None
        extra = near.data.nbytes + near.indices.nbytes if near is not None else 0
        main = self._matrix if self.summation is None else self.summation
        return main.nbytes + extra

    def _matvec(self, q: ndarray) -> ndarray:
        q = np.asarray(q, dtype=float).ravel()
        if self.summation is None:
            return self._matrix @ q
        out = self.summation.apply(q)
        return out if self.correction is None else out + self.correction.near @ q

    def _matmat(self, q: ndarray) -> ndarray:
        if self.summation is None:
            return self._matrix @ q
        return np.stack([self._matvec(column) for column in q.T], axis=1)

    def _rmatvec(self, w: ndarray) -> ndarray:
        if self.summation is not None:
            raise NotImplementedError("the fast summation has no transpose")
        return self._matrix.T @ w

    def __repr__(self) -> str:
        m, n = self.shape
        return (
            f"<skfem_dual InfluenceOperator object>\n  {self.method} summation from {n} cells to "
            f"{m} points\n  Substrate: {self.substrate}\n  Error: {self.error:.1e}, of rows "
            f"{self.row_error:.1e}, allowed {self.rtol:.1e}\n  Memory: {self.memory / 2**20:.4g} "
            f"MiB, set-up {self.setup_time:.2g} s (expected: {self.estimate})"
        )


def available_memory() -> float:
    """Bytes that can be used without swapping, as far as the system tells; else infinity."""
    try:
        with open("/proc/meminfo") as file:
            for line in file:
                if line.startswith("MemAvailable:"):
                    return 1024.0 * int(line.split()[1])
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (OSError, ValueError, AttributeError):
        return float("inf")
