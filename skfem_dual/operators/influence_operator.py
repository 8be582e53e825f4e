"""Settlements under pressures on cells as a linear operator, dense or fast.

The matrix is that of boundary elements with one collocation point in each, (5) of the paper; what
stands for it is made to a tolerance and checked on exact rows.
"""

from collections.abc import Callable
from math import prod
from time import perf_counter
from typing import Any, Literal

import numpy as np
from numpy import ndarray
from scipy.sparse.linalg import LinearOperator
from skfem import CellBasis

from ..arguments import (
    checked_array,
    checked_choice,
    checked_indices,
    checked_instance,
    checked_number,
)
from ..elements.edge_weights import EdgeWeights
from ..elements.influence import as_points
from ..elements.slopes import Slopes
from ..grids.partition import Partition
from ..ground.periodic import PeriodicGround, checked_ground
from ..ground.substrates import Substrate
from ..messages import shown
from .attempts import COARSEST, ROWS, product, within
from .discretisation import Discretisation
from .entries import EXACT, Entries
from .fmm.summation import SINGLE, FastSummation
from .resources import choose, require_matrix
from .toeplitz import BlockToeplitz, require_period

Method = Literal["auto", "dense", "fast", "toeplitz"]
#: tolerance of operators if none is given
RTOL = 1e-6
#: tolerance of transforms on a regular grid: their errors are those of rounding
ROUNDING = 1e-10


class InfluenceOperator(LinearOperator):
    """Settlements of collocation points under mean pressures of cells, the matrix of (5).

    Parameters
    ----------
    substrate : HalfSpace, GradedHalfSpace, LayeredHalfSpace or PeriodicGround
        The ground; the last under constant pressures on a regular grid that covers its period.
    basis : CellwiseBasis, CellBasis or Partition
        Piecewise constants, see `RigidPunch`, or the loaded cells themselves; of any other basis
        of scalars its elements are the cells, and `transfer` to constants gives their means.
    rtol : float
        Error allowed in a settlement, relative to what the greatest of the pressures would
        cause on all cells, contributions taken positive, which is no less than a hundredth of
        that on homogeneous ground with the moduli of the surface. It is verified on 16 to 64
        rows, fewer of more than 260 000 cells, under pressures of one sign and of random ones:
        few others can be off up to twice as far, among long and thin cells, or below 1e-7, some
        times.
        Beside what few loaded cells do themselves errors are larger: see the notes. Below 1e-8,
        for dense matrices only: exact entries.
    method : {"auto", "dense", "fast", "toeplitz"}
        A matrix; a fast summation in linear time and memory; transforms, exact but for rounding,
        of cells on a regular grid under constant pressure and their centroids; or what is sooner
        ready for some twenty products and fits into the memory. The grid is that of rectangles
        along the axes, all of one size, in any of its places: a uniform MeshQuad or a part of it.
    edge : {"singular", "constant"}, EdgeWeights or Slopes
        How the pressure varies inside cells, see `RigidPunch`, whatever the ground; with weights
        alone by them alone.
    collocation : {"centroid", "node"} or (2, m) array of float
        Where settlements are found: in a point of each cell, or in any points of the surface.
    like : InfluenceOperator, optional
        One from the same cells to other points: what it knows of the cells serves again.

    Attributes
    ----------
    method : {"dense", "fast", "toeplitz"}
        What was chosen.
    estimate : Estimate
        Memory and time expected before the work.
    error : float
        Greatest error found on sampled rows, as ``rtol`` is meant.
    row_error : float
        Error of the sampled rows in the 2-norm, as for pressures of random signs; up to ten times
        as large.
    setup_time : float
        Seconds it took.
    correction : EdgeCorrection or None
        What edge-weighted cells add to it.
    sloping : SlopeCorrection or None
        What slopes inside the cells add.

    Raises
    ------
    ValueError, TypeError
        If an argument is none of the above.
    MemoryError
        Before the work, if the memory at hand will not do.
    ConvergenceError
        If the summation does not reach ``rtol``.

    Notes
    -----
    Products write nothing that is shared: threads may use one operator at a time.

    Single entries are not as close as sums: with a tolerance of 1e-6 the settlements by one
    loaded cell among 5000 are off by up to 2e-4 of themselves, those by a hundred of them by 1e-5,
    and with coarser ones those by slivers beside large cells by percents. ``rows`` are exact, and
    so is ``rtol=0``.

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
        basis: CellBasis | Partition,
        rtol: float = RTOL,
        method: Method = "auto",
        *,
        edge: Literal["singular", "constant"] | EdgeWeights | Slopes = "singular",
        collocation: Literal["centroid", "node"] | ndarray = "centroid",
        like: "InfluenceOperator | None" = None,
    ) -> None:
        checked_ground(substrate)
        rtol = checked_number("rtol", rtol, at_least=0, at_most=COARSEST)
        checked_choice("method", method, ("auto", "dense", "fast", "toeplitz"))
        if method == "fast" and rtol < EXACT:
            raise ValueError(
                f"expected a tolerance of at least {EXACT:g} of the fast summation, got {rtol:g}. "
                'Remedy: method="dense"'
            )
        made = Discretisation.of(substrate, basis, edge, collocation)
        ground, partition, weights, slopes, x = made
        m, n = x.shape[1], len(partition)
        super().__init__(np.dtype(float), (m, n))
        self.substrate, self.partition, self.x = substrate, partition, x
        self._ground, self.weights, self.slopes = ground, weights, slopes
        lattice = made.lattice
        if method == "toeplitz" and lattice is None:
            raise ValueError(
                'expected constant pressures on a regular grid of cells for method="toeplitz", '
                'and their centroids. Remedy: edge="constant" on a uniform MeshQuad, or '
                'method="auto"'
            )
        if periodic := isinstance(substrate, PeriodicGround):
            require_period(substrate, lattice)
            checked_choice("method", method, ("auto", "toeplitz"))
        layered = not periodic and ground.remainder is not None
        places = None if lattice is None else prod(lattice.shape)
        known = None if like is None else self._expansions(like)
        asked = method, m, n, float(rtol), layered, places
        self.method, self.estimate = choose(*asked, known is not None)
        self._asked = float(rtol)
        self.rtol = min(self._asked, ROUNDING) if self.method == "toeplitz" else self._asked
        start = perf_counter()
        single = self.method == "fast" and rtol >= SINGLE
        self._entries = Entries(ground, partition, x, weights, slopes, single)
        self.correction, self.sloping = self._entries.correction, self._entries.sloping
        kept = within(self._entries, self.method, self.rtol, known)
        self._kept, self.error, self.row_error = kept
        if self.method == "toeplitz":  # far from the origin not closer than coordinates are
            self.rtol = max(self.rtol, self.error, self.row_error)
        self.setup_time = perf_counter() - start

    @classmethod
    def from_partition(
        cls,
        substrate: Substrate,
        partition: Partition,
        x: ndarray,
        law: EdgeWeights | Slopes | None = None,
        rtol: float = RTOL,
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
        law : EdgeWeights or Slopes, optional
            How the pressure varies inside the cells; not at all by default.

        Raises
        ------
        TypeError, ValueError, MemoryError, ConvergenceError
            As the class.
        """
        checked_instance("partition", partition, Partition)
        if law is not None and not isinstance(law, (EdgeWeights, Slopes)):
            raise TypeError(f"expected EdgeWeights or Slopes for law, got {shown(law)}")
        cells, points = (substrate, partition, rtol, method), as_points(x)
        return cls(*cells, edge="constant" if law is None else law, collocation=points)

    def at(self, x: ndarray, rtol: float | None = None) -> "InfluenceOperator":
        """From the same cells to other points ``x`` of shape (2, m), to the tolerance asked of
        this operator if no other is given.

        Raises
        ------
        TypeError, ValueError, MemoryError, ConvergenceError
            As the class.
        """
        rtol = self._asked if rtol is None else rtol
        cells, points = (self._ground, self.partition, rtol), as_points(x)
        law: Any = "constant" if self._law is None else self._law
        return type(self)(*cells, edge=law, collocation=points, like=self)

    def _expansions(self, like: "InfluenceOperator") -> FastSummation | None:
        """What another operator knows of the same cells."""
        checked_instance("like", like, InfluenceOperator)
        own, other = ((op._ground, op.partition, op.weights) for op in (self, like))
        if not (own[0] == other[0] and own[1] is other[1] and own[2] is other[2]):
            raise ValueError(
                "expected an operator from the same cells for like, got one of another ground, "
                "partition or law. Remedy: operator.at(x)"
            )
        return like.summation

    @property
    def _law(self) -> EdgeWeights | Slopes | None:
        return self.weights if self.slopes is None else self.slopes

    @property
    def toeplitz(self) -> BlockToeplitz | None:
        """What an operator on a regular grid multiplies with."""
        return self._kept if isinstance(self._kept, BlockToeplitz) else None

    @property
    def summation(self) -> FastSummation | None:
        """What a fast operator multiplies with."""
        return self._kept if isinstance(self._kept, FastSummation) else None

    def rows(self, i: ndarray) -> ndarray:
        """Exact rows of the matrix, of the points with the numbers ``i``; shape (len(i), n).

        Raises
        ------
        TypeError, ValueError
            If they are no whole numbers, or not those of points.
        """
        one = isinstance(i, (int, np.integer))
        i = checked_indices("i", [i] if one else i, self.shape[0])
        return (self.toeplitz or self._entries).rows(i)

    def diagonal(self) -> ndarray:
        """Settlement of each cell's own point under unit pressure on it, exact; shape (n,)."""
        m, n = self.shape
        if m != n:
            raise ValueError(f"expected a square operator, got shape {self.shape}")
        return (self.toeplitz or self._entries).diagonal()

    def to_dense(self) -> ndarray:
        """The matrix, read-only; made by a dense operator of the same tolerance if need be.

        Raises
        ------
        MemoryError
            Before the work, if the memory at hand will not hold it.
        """
        if isinstance(self._kept, ndarray):
            return self._kept
        require_matrix(*self.shape)
        if isinstance(self._kept, BlockToeplitz):
            matrix = self._kept.to_dense()
            matrix.setflags(write=False)
            return matrix
        cells = self._ground, self.partition, self.x, self._law
        return self.from_partition(*cells, self.rtol, "dense").to_dense()

    @property
    def memory(self) -> int:
        """Bytes that are kept."""
        near = 0 if self.sloping is None else self.sloping.near.nbytes
        if self.correction is not None:
            near += self.correction.near.data.nbytes + self.correction.near.indices.nbytes
        return self._kept.nbytes + near

    def __matmul__(self, pressure: Any) -> Any:
        """Settlements under mean pressures of shape (n,) or (n, k); or the product with another
        operator.

        Solvers of scipy call `matvec` and `matmat`, which check shapes only.

        Raises
        ------
        TypeError, ValueError
            If pressures are no finite numbers of all cells.
        """
        if isinstance(pressure, LinearOperator):
            return super().dot(pressure)
        try:
            split = np.iscomplexobj(pressure)
        except ValueError:  # lists of unequal lengths, which are refused below
            split = False
        if split:
            pressure = np.asarray(pressure)
            return self @ pressure.real + 1j * (self @ pressure.imag)
        pressure, n = checked_array("pressure", pressure, None, order="K"), self.shape[1]
        if pressure.ndim not in (1, 2) or len(pressure) != n:
            raise ValueError(
                f"expected pressure of shape ({n},) or ({n}, k), of all cells, got "
                f"{pressure.shape}"
            )
        if not pressure.size:
            return np.zeros((self.shape[0], 0))
        return self._matmat(pressure)

    def dot(self, x: Any) -> Any:
        """As ``operator @ x``; with a number the operator times it."""
        return super().dot(x) if np.isscalar(x) else self @ x

    def _matmat(self, q: ndarray) -> ndarray:
        if np.iscomplexobj(q):
            return self._matmat(q.real) + 1j * self._matmat(q.imag)
        # kernels take native numbers
        return product(self._entries, self._kept, np.asarray(q, dtype=float))

    def roughly(self, q: ndarray) -> ndarray:
        """Settlements under pressures (n, k), a fast summation's rounded to single precision.

        Raises
        ------
        TypeError, ValueError
            If they are no such array, or not finite.
        """
        q = checked_array("q", q, (self.shape[1], "k"), order="K")
        # in units of the forces: single precision ends at 1e38
        _, exponent = np.frexp(self.partition.areas @ np.abs(q))
        scaled = np.ldexp(q, -exponent)
        return np.ldexp(product(self._entries, self._kept, scaled, rough=True), exponent)

    def coarsely(self, q: ndarray) -> ndarray:
        """Settlements under pressures (n, k) without slopes, to percents, by short expansions.

        Raises
        ------
        TypeError
            If the operator is not a fast summation.
        """
        if self.summation is None:
            raise TypeError(f"expected a fast summation, got {self.method}")
        return self._entries.summed(self.summation.coarse, q, None)

    def with_slopes(self, q: ndarray, slopes: Callable[[ndarray], ndarray]) -> ndarray:
        """Settlements under mean pressures and other slopes than theirs, see `Entries.summed`.

        Raises
        ------
        TypeError
            If the operator is not a fast summation of cells with slopes.
        """
        if self.summation is None or self.slopes is None:
            raise TypeError(f"expected a fast summation of cells with slopes, got {self.method}")
        return self._entries.summed(self.summation, q, slopes)

    def _rmatvec(self, w: ndarray) -> ndarray:
        if isinstance(self._kept, FastSummation):
            raise NotImplementedError("the fast summation has no transpose")
        if np.iscomplexobj(w):
            return self._rmatvec(w.real) + 1j * self._rmatvec(w.imag)
        if isinstance(self._kept, BlockToeplitz):
            return self._kept @ w  # symmetric
        return self._kept.T @ w

    def __repr__(self) -> str:
        m, n = self.shape
        return (
            f"<skfem_dual InfluenceOperator object>\n  {self.method} summation from {n} cells to "
            f"{m} points\n  Substrate: {self.substrate}\n  Error: {self.error:.1e}, allowed "
            f"{self.rtol:.1e}; of rows {self.row_error:.1e}, allowed {ROWS * self.rtol:.1e}\n"
            f"  Memory: {self.memory / 2**20:.4g} "
            f"MiB, set-up {self.setup_time:.2g} s (expected: {self.estimate})"
        )
