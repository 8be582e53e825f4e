"""The functional H(U, V) of Section 5 and its minimum."""

from dataclasses import astuple, dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.sparse import block_array, csr_array, diags_array
from scipy.sparse.linalg import LinearOperator, SuperLU, cg, splu

from ..arguments import LARGEST, checked_array, checked_choice, checked_number
from ..errors import ConvergenceError, MeshError
from ..grids.couples import GridCouple, boundary_nodes
from ..grids.dual_mesh import DualMesh
from ..grids.polygons import Polygons, some
from ..kernels.once import computed_once
from ..messages import shown

#: up to so many unknowns the matrix is factorised; more are found by conjugate gradients
DIRECT = 20_000
#: relative residual of the conjugate gradients
TOLERANCE = 1e-12
#: and the largest number of their steps
STEPS = 5000
#: corrections until the last is so much less than the values
CORRECTIONS, CLOSE = 6, 1e-6
#: error of a solution by factors over the ratio of the weights, and up to which none is corrected
ROUNDING, SURE = 1e-15, 1e-7
#: factor on W2 by the reading of the last term: (sum - 4 U)^2 is 16 (mean - U)^2
LAST = {"sums": 16.0, "means": 1.0}


@dataclass(frozen=True)
class Weights:
    """The eight weights of the functional H(U, V), none negative.

    Only their ratios matter. ``A1``, ``A2``: new values keep to the old ones of their grid.
    ``B1``, ``B2``: means of the new values around a node keep to its old value. ``C1``, ``C2``:
    new values keep to the means of the old ones around them. ``D1``, ``D2``: new values keep to
    the means of the new ones around them. The first of a pair belongs to the nodes of the first
    grid.

    Raises
    ------
    TypeError
        If a weight is no number.
    ValueError
        If one is negative or not finite, or ``A1`` or ``A2`` is zero: these make the minimum
        unique.
    """

    A1: float
    A2: float
    B1: float = 0.0
    B2: float = 0.0
    C1: float = 0.0
    C2: float = 0.0
    D1: float = 0.0
    D2: float = 0.0

    def __post_init__(self) -> None:
        for name, value in zip((f.name for f in fields(self)), astuple(self)):
            value = checked_number(name, value, at_least=0, at_most=LARGEST)
            object.__setattr__(self, name, value)
        for name in ("A1", "A2"):
            checked_number(name, getattr(self, name), above=0)

    @classmethod
    def init_paper(
        cls,
        old: float,
        new: float,
        middle: float = 16.0,
        last: Literal["sums", "means"] = "sums",
    ) -> "Weights":
        """The three weights A : B : C of Section 5.1.

        Parameters
        ----------
        old : float
            W1, weight of the old values, A1 = A2.
        new : float
            W2, weight of the new values.
        middle : float
            The paper's fixed B = 16, B1 = B2.
        last : {"sums", "means"}
            How the last term of the functional is read. ``"means"``: as it is printed, means of
            four new values minus the new value, D1 = D2 = W2. ``"sums"``: sums of four minus
            four times the value, D1 = D2 = 16 W2. The paper's results are those of sums: only
            they give the errors of Table 2, the smoothing of Fig. 16 and the best ratios
            W2 / W1 that Section 5.1 tells (``examples/ex18_table2.py``).

        Raises
        ------
        TypeError, ValueError
            If a weight is no number, negative or not finite, W1 is zero or ``last`` is something
            else.

        Examples
        --------
        >>> Weights.init_paper(64, 16).D1, Weights.init_paper(64, 16, last="means").D1
        (256.0, 16.0)
        """
        weight = LAST[checked_choice("last", last, LAST)]
        weight *= checked_number("new", new, at_least=0, at_most=LARGEST / weight)
        return cls(old, old, middle, middle, 0.0, 0.0, weight, weight)


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Which nodes of one grid surround each node of the other, and with what coefficients.

    The coefficients are the mean value coordinates of a node in the cell of the other grid around
    it (Floater, Comput. Aided Geom. Des. 20 (2003) 19-27): positive, since the cell is
    star-shaped about its node, with the sum 1, and exact for linear fields. Three vertices have
    their barycentric coordinates, the four of a rectangle about its centre a quarter each.

    Attributes
    ----------
    alpha : (M, N) csr_array
        Row ``i``: coefficients of the nodes of the second grid around node ``i`` of the first;
        empty if that is not an inner node.
    beta : (N, M) csr_array
        Row ``j``: coefficients of the nodes of the first grid around node ``j`` of the second.
    """

    alpha: csr_array
    beta: csr_array

    @property
    def inner(self) -> tuple[ndarray, ndarray]:
        """Whether each node of the first and of the second grid has neighbours around it."""
        return np.diff(self.alpha.indptr) > 0, np.diff(self.beta.indptr) > 0

    def checked(self, F: ArrayLike, G: ArrayLike) -> tuple[ndarray, ndarray]:
        """Values at the nodes of both grids as arrays of float.

        Raises
        ------
        ValueError
            If there is not one finite value for each node.
        """
        F, G = checked_array("F", F, None, each="node"), checked_array("G", G, None, each="node")
        shape = self.alpha.shape
        fit = F.ndim in (1, 2) and G.ndim == F.ndim and F.shape[1:] == G.shape[1:]
        if not fit or (len(F), len(G)) != shape:
            raise ValueError(
                f"expected F and G with one value for each of the {shape[0]} and {shape[1]} "
                f"nodes, got shapes {F.shape} and {G.shape}"
            )
        return F, G

    @classmethod
    def of(cls, grids: DualMesh | GridCouple) -> "Neighbours":
        """The neighbours in a couple of grids.

        Parameters
        ----------
        grids : DualMesh or GridCouple
            Nodes of the first grid: those of the triangulation, or of grid A. Nodes of the
            second: the barycentres of the triangles, or the nodes of grid B.

        Raises
        ------
        TypeError
            If it is neither.
        MeshError
            If the cell around a node is not star-shaped about it.
        """
        if isinstance(grids, DualMesh):
            a, b = grids.primal_partition, grids.partition
            # nodes of the dual grid on the boundary have no values: no inner cell has them
            n = grids.mesh.nelements
            node_in_a, node_in_b = np.arange(n), np.arange(len(grids))
            node_in_b[boundary_nodes(a)] = -1
            shape = len(grids), n
        elif isinstance(grids, GridCouple):
            a, b, node_in_a, node_in_b = grids.a, grids.b, grids.node_in_a, grids.node_in_b
            if grids.kind == "1-type":
                node_in_b = np.where(np.isin(node_in_b, boundary_nodes(a)), -1, node_in_b)
            shape = a.polygons.p.shape[1], b.polygons.p.shape[1]
        else:
            raise TypeError(f"expected a DualMesh or a GridCouple, got {shown(grids)}")
        return cls(
            surrounding_means(b.polygons, node_in_b, a.polygons.p, shape),
            surrounding_means(a.polygons, node_in_a, b.polygons.p, shape[::-1]),
        )


def factorised(matrix: Any) -> SuperLU:
    """Factors of a sparse matrix that is symmetric and positive definite."""
    options = {"SymmetricMode": True}
    return splu(matrix.tocsc(), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def surrounding_means(
    polygons: Polygons, node: ndarray, x: ndarray, shape: tuple[int, int]
) -> csr_array:
    """Mean value coordinates of nodes in the cells around them.

    Parameters
    ----------
    polygons : Polygons
        The cells.
    node : (npolygons,) array of int
        The node in each cell, -1 if there is none.
    x : (2, nnodes) array of float
        The nodes.
    shape : pair of int
        Shape of the matrix, number of nodes and of vertices.

    Returns
    -------
    csr_array
        Row ``i`` holds the coordinates of node ``i``; it is empty if no cell is around it.

    Raises
    ------
    MeshError
        If a cell is not star-shaped about its node.
    """
    held = np.repeat(node >= 0, polygons.sizes)
    sizes = polygons.sizes[node >= 0]
    last = np.cumsum(sizes) - 1
    row, column = np.repeat(node[node >= 0], sizes), polygons.indices[held]
    after = np.arange(1, len(row) + 1)
    after[last] = last + 1 - sizes
    v = polygons.p[:, column] - x[:, row]
    w, r = v[:, after], np.hypot(*v)
    sine, cosine = v[0] * w[1] - v[1] * w[0], v[0] * w[0] + v[1] * w[1]
    product = r * r[after]
    if np.any(bad := ~(sine > 1e-12 * product)):
        raise MeshError(
            f"expected cells that are star-shaped about their nodes; those around nodes "
            f"{some(np.unique(row[bad]))} are not. Remedy: check_dual tells what is wrong with a "
            "couple"
        )
    half = sine / (product + cosine)  # tangent of half the angle between two vertices
    before = np.empty_like(after)
    before[after] = np.arange(len(row))
    weight = (half + half[before]) / r
    total = np.bincount(row, weight, shape[0])
    matrix = csr_array((weight / total[row], (row, column)), shape=shape)
    matrix.sum_duplicates()
    return matrix


@dataclass(frozen=True, eq=False)
class CoupleFunctional:
    """The functional H(U, V) of Section 5 for one couple of grids and one set of weights.

    H is a quadratic function of the new values; its matrix is sparse, symmetric, and positive
    definite, with a condition number that is bounded by the weights alone. Up to `DIRECT`
    unknowns it is factorised when first needed, for any number of right-hand sides; beyond,
    conjugate gradients take a number of steps that does not grow with the grids.

    Parameters
    ----------
    neighbours : Neighbours
        The couple of grids.
    weights : Weights
        The eight weights.

    Examples
    --------
    >>> from skfem_dual import rectangular_couple
    >>> neighbours = Neighbours.of(rectangular_couple(range(11), range(11)))
    >>> functional = CoupleFunctional(neighbours, Weights.init_paper(16, 256))
    >>> rng = np.random.default_rng(0)
    >>> F, G = rng.uniform(-1, 1, 121), rng.uniform(-1, 1, 100)
    >>> U, V = functional.minimise(F, G)
    >>> print(f"{U.std() / F.std():.1f}, {V.std() / G.std():.1f}")
    0.5, 0.3
    """

    neighbours: Neighbours
    weights: Weights

    def value(self, F: ArrayLike, G: ArrayLike, U: ArrayLike, V: ArrayLike) -> float:
        """The functional H for old values F, G and new values U, V."""
        F, G = self.neighbours.checked(F, G)
        U, V = self.neighbours.checked(U, V)
        w, (alpha, beta) = self.weights, (self.neighbours.alpha, self.neighbours.beta)
        i, j = self.neighbours.inner
        terms = (
            (w.A1, U - F),
            (w.A2, V - G),
            (w.B1, (F - alpha @ V)[i]),
            (w.B2, (G - beta @ U)[j]),
            (w.C1, (U - alpha @ G)[i]),
            (w.C2, (V - beta @ F)[j]),
            (w.D1, (U - alpha @ V)[i]),
            (w.D2, (V - beta @ U)[j]),
        )
        return float(sum(weight * np.sum(term**2) for weight, term in terms))

    @computed_once
    def matrix(self) -> csr_array:
        """Matrix of the normal equations, half the second derivative of H; order (U, V)."""
        w, (alpha, beta) = self.weights, (self.neighbours.alpha, self.neighbours.beta)
        i, j = (inner.astype(float) for inner in self.neighbours.inner)
        coupling = w.D1 * alpha + w.D2 * beta.T
        own = [diags_array(w.A1 + (w.C1 + w.D1) * i), diags_array(w.A2 + (w.C2 + w.D2) * j)]
        first = own[0] + (w.B2 + w.D2) * (beta.T @ beta)
        second = own[1] + (w.B1 + w.D1) * (alpha.T @ alpha)
        return block_array([[first, -coupling], [-coupling.T, second]], format="csr")

    def descent(self, F: ndarray, G: ndarray, U: ndarray, V: ndarray) -> ndarray:
        """Minus half the derivative of H at new values U, V, (M + N, ...): right-hand side of the
        normal equations for what they lack. It is of differences: none of linear fields."""
        w, (alpha, beta) = self.weights, (self.neighbours.alpha, self.neighbours.beta)
        i, j = (inner.reshape(-1, *F.shape[1:] and (1,)) for inner in self.neighbours.inner)
        # how far both ends of a term are apart, as `value` has them
        around_U, around_V = (alpha @ V - U) * i, (beta @ U - V) * j
        return np.concatenate(
            [
                w.A1 * (F - U)
                + w.C1 * (alpha @ G - U) * i
                + w.D1 * around_U
                - beta.T @ (w.B2 * (beta @ U - G) * j + w.D2 * around_V),
                w.A2 * (G - V)
                + w.C2 * (beta @ F - V) * j
                + w.D2 * around_V
                - alpha.T @ (w.B1 * (alpha @ V - F) * i + w.D1 * around_U),
            ]
        )

    def minimise(self, F: ndarray, G: ndarray) -> tuple[ndarray, ndarray]:
        """The new values for which H is least.

        Parameters
        ----------
        F, G : (M,) and (N,) array of float, or (M, k) and (N, k)
            Old values at the nodes of the first and of the second grid, k couples of them at once.

        Returns
        -------
        U, V : arrays of the same shapes
            New values.

        Raises
        ------
        ValueError
            If there is not one finite value for each node.
        ConvergenceError
            If the weights are so far apart that the minimum is not found.
        """
        F, G = self.neighbours.checked(F, G)
        U, V = F.copy(), G.copy()
        size = max(np.abs(F).max(initial=0.0), np.abs(G).max(initial=0.0))
        close, steep = CLOSE * size, self.descent(F, G, U, V)
        if np.abs(steep).max(initial=0.0) <= ROUNDING * max(astuple(self.weights)) * size:
            return U, V  # linear fields, but for rounding
        for _ in range(CORRECTIONS):
            lacking = self.solve(steep)
            change = np.abs(lacking).max(initial=0.0)
            if not np.isfinite(change):
                break
            U, V = U + lacking[: len(F)], V + lacking[len(F) :]
            if self._sure or change <= close:
                return U, V
            steep = self.descent(F, G, U, V)
        raise ConvergenceError(self._apart)

    @property
    def _sure(self) -> bool:
        """Whether weights are so near each other that one solution is enough."""
        w = astuple(self.weights)
        error = ROUNDING if self.matrix.shape[0] <= DIRECT else TOLERANCE
        return max(w) * error <= SURE * min(w[:2])

    @property
    def _apart(self) -> str:
        return (
            f"the minimum of H was not found with {self.weights}. Remedy: weights that differ less"
        )

    def solve(self, right_side: ndarray) -> ndarray:
        """Solve the normal equations for one or more right-hand sides, shape (M + N, ...)."""
        if self.matrix.shape[0] <= DIRECT:
            return self._factors.solve(right_side)
        columns = right_side.reshape(len(right_side), -1).T
        return np.stack([self._iterate(b) for b in columns], axis=-1).reshape(right_side.shape)

    @computed_once
    def _factors(self) -> SuperLU:
        try:
            return factorised(self.matrix)
        except RuntimeError as error:  # exactly singular, by rounding
            raise ConvergenceError(self._apart) from error

    def _iterate(self, b: ndarray) -> ndarray:
        matrix, inverse = self.matrix, 1 / self.matrix.diagonal()
        jacobi = LinearOperator(matrix.shape, matvec=lambda r: inverse * r, dtype=float)
        x, info = cg(matrix, b, x0=inverse * b, rtol=TOLERANCE, atol=0.0, maxiter=STEPS, M=jacobi)
        if info:
            raise ConvergenceError(self._apart)
        return x
