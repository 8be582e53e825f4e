"""A symmetric semidefinite sparse matrix by factors of most of it and a small matrix.

A few DOFs, spread over every part of a structure, are split off; held by them the rest is positive
definite and factorised once. The Schur complement, the stiffness against displacements of the few,
is a small matrix whose null space is that of all, told apart by its eigenvalues however fine the
mesh is. With its pseudo-inverse the factors give a symmetric generalised inverse.

Source: C. Farhat and F.-X. Roux, A method of finite element tearing and interconnecting and its
parallel solution algorithm, Int. J. Numer. Meth. Engng 32 (1991), where floating parts of
structures are solved by generalised inverses in the same way.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import csc_matrix, identity
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu

#: DOFs split off from each part of a structure: more than a part has motions
SPLIT = 32
#: springs on a diagonal of ones, pivots that then are weak, how many of them are split off, and
#: part of all DOFs that is split off where there is a mechanism
SPRING, WEAK, MOST, MECHANISM = 1e-10, 1e-4, 2048, 0.5
#: eigenvalues of the small matrix below so many times the largest may be zero
NULL = 1e-9
#: pivots, of a matrix with a diagonal of ones, below which it is singular
SINGULAR = 1e-10


@dataclass(frozen=True, eq=False)
class Split:
    """A symmetric semidefinite matrix by factors of a part and the Schur complement of the rest.

    Attributes
    ----------
    few, rest : (k,) and (n - k,) array of int
        The DOFs split off, and the others.
    factors : SuperLU or None
        Of the rest; None if there is nothing.
    coupling : (n - k, k) array of float
        Displacements of the rest, less the sign, by unit ones of the few.
    small : (k, k) array of float
        Pseudo-inverse of the Schur complement.
    null : (n, m) array of float
        Null space of the matrix.
    """

    few: ndarray
    rest: ndarray
    factors: SuperLU | None
    coupling: ndarray
    small: ndarray
    null: ndarray

    @classmethod
    def from_matrix(cls, matrix: csc_matrix, node: ndarray, noise: float) -> "Split":
        n = matrix.shape[0]
        few, rest, factors = _parted(matrix, node)
        between = matrix[rest][:, few].toarray()
        coupling = between if factors is None else factors.solve(between)
        schur = matrix[few][:, few].toarray() - between.T @ coupling
        values, vectors = np.linalg.eigh((schur + schur.T) / 2)
        top = np.abs(values).max(initial=0.0)
        if len(values) and values[0] < -NULL * max(top, 1.0):
            raise negative(values[0], few[np.abs(vectors[:, 0]).argmax()])
        zero = values <= NULL * top
        null = np.empty((n, np.count_nonzero(zero)))
        null[few] = vectors[:, zero]
        null[rest] = -coupling @ vectors[:, zero]
        # thin sheets bend by as little, but by more than rounding
        none = values[zero] <= noise * np.maximum(whole_work(matrix, null), top)
        zero[zero], null = none, null[:, none]
        small = vectors[:, ~zero] / values[~zero] @ vectors[:, ~zero].T
        return cls(few, rest, factors, coupling, small, null)

    def solve(self, rhs: ndarray) -> ndarray:
        out = np.empty(rhs.shape)
        inner = rhs[self.rest]
        out[self.few] = self.small @ (rhs[self.few] - self.coupling.T @ inner)
        if self.factors is not None:
            out[self.rest] = self.factors.solve(np.asfortranarray(inner))
            out[self.rest] -= self.coupling @ out[self.few]
        return out


def negative(value: float, dof: int) -> ValueError:
    """What is wrong with one that has an eigenvalue below zero, over the largest."""
    return ValueError(
        "expected a positive semidefinite stiffness, got one with negative energy: "
        f"{value:.2e} of the largest, near DOF {dof}. "
        "Remedy: check the signs of its forms; assemble and write them in double precision"
    )


def whole_work(matrix: csc_matrix, moved: ndarray) -> ndarray:
    """Work of all entries of a matrix, as if none cancelled, on displacements (n, m)."""
    ways = np.abs(moved)
    return np.sum(ways * (abs(matrix) @ ways), axis=0)


def _parted(matrix: csc_matrix, node: ndarray) -> tuple[ndarray, ndarray, SuperLU | None]:
    """A few DOFs of every part that hangs together, all the others, and factors of these.

    The few are taken by chance. Once in a while they do not hold the structure, as slopes of a
    plate alone, and more of them are taken; and where hinges or frames join many plates, those by
    which the others move with hardly any resistance.
    """
    _, part = connected_components(matrix, directed=False)
    order = np.lexsort((np.random.default_rng(0).random(len(part)), part))
    rank = np.arange(len(part)) - np.searchsorted(part[order], part[order])
    few, rest = np.zeros(len(node), dtype=bool), order
    for count in (SPLIT, 8 * SPLIT, None):
        few[_weakest(matrix, rest) if count is None else order[rank < count]] = True
        if count is None and few.mean() > MECHANISM:
            break  # more motions than many rigid parts have
        rest = np.nonzero(~few)[0]
        rest = rest[_order(matrix[rest][:, rest], node[rest])]
        factors = _factorised(matrix[rest][:, rest].tocsc()) if len(rest) else None
        if factors is not None or len(rest) == 0:
            return np.nonzero(few)[0], rest, factors
    raise ValueError(
        "expected a structure that moves without resistance only as rigid parts, got one with a "
        f"mechanism beyond them among its {len(node)} DOFs. Remedy: elements that are stable, "
        "full quadrature, or hold the DOFs in question, D="
    )


def _weakest(matrix: csc_matrix, rest: ndarray) -> ndarray:
    """Those of some DOFs, in their order of elimination, of the least pivots where springs hold
    each by a little: of every motion without resistance there is one."""
    own = matrix[rest][:, rest] + SPRING * identity(len(rest))
    pivots = splu(own.tocsc(), "NATURAL", 0.0, options={"SymmetricMode": True}).U.diagonal()
    return rest[np.argsort(pivots)[: np.count_nonzero(pivots < WEAK)][:MOST]]


def _order(matrix: csc_matrix, node: ndarray) -> ndarray:
    """Order of elimination with little fill: minimum degree on the graph of the nodes.

    Source: C. Ashcraft, Compressed graphs and the minimum degree algorithm, SIAM J. Sci. Comput.
    16 (1995): on groups of DOFs it is sooner done and leaves less fill than on single ones.
    """
    if len(node) == 0:
        return node
    _, node = np.unique(node, return_inverse=True)
    to_nodes = csc_matrix((np.ones(len(node)), (node, np.arange(len(node)))))
    graph = (to_nodes @ abs(matrix) @ to_nodes.T).tocsc()
    graph.data[:] = -1.0
    graph.setdiag(len(node))  # any positive definite matrix will do
    factors = splu(graph, "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
    return np.argsort(factors.perm_c[node], kind="stable")


def _factorised(matrix: csc_matrix) -> SuperLU | None:
    """Factors without pivoting, so that the pivots tell the signs; None of a singular matrix."""
    try:
        factors = splu(matrix, "NATURAL", 0.0, options={"SymmetricMode": True})
    except RuntimeError:  # exactly singular
        return None
    pivots = factors.U.diagonal()
    wrong = pivots[pivots < SINGULAR]
    if len(wrong) and wrong[0] < -SINGULAR:  # those after a zero say nothing
        raise ValueError(
            "expected a positive semidefinite stiffness, got one with negative energy: pivot "
            f"{wrong[0]:.2e} of a diagonal of ones. Remedy: check the signs of its forms"
        )
    return None if len(wrong) else factors
