"""Iterative solution of the equations of contact for several right-hand sides.

GMRES, preconditioned by exact solutions on small groups of cells with their neighbours, of which
each group keeps its own part: restricted additive Schwarz (Cai and Sarkis, 1999).
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator, gmres
from tqdm import tqdm

from .fmm import Blocks
from .fmm_compiled import vectorised
from .fmm_lists import near_lists
from .fmm_threads import Threads
from .influence import _in_blocks
from .near import NearField
from .operators import InfluenceOperator
from .quadtree import Quadtree

#: mean number of cells in a group of a uniform mesh
GROUP = 10
#: neighbours of a group lie so far beyond it, over the half-width of its box
OVERLAP = 0.9
#: directions that GMRES keeps before it starts anew
RESTART = 60
#: iterations in all
MOST = 300
#: numbers of a vector that stay at hand
PIECE = 2048


@dataclass(frozen=True, eq=False)
class Preconditioner:
    """An approximate inverse of a square operator.

    Attributes
    ----------
    cells : (n,) array of int
        The cells in the order of the blocks.
    blocks : Blocks
        Rows of each group in the inverse on the group and its neighbours.
    """

    cells: ndarray
    blocks: Blocks

    @classmethod
    def build(cls, operator: InfluenceOperator) -> "Preconditioner":
        """Of an operator from cells to the collocation point of each."""
        if operator.shape[0] != operator.shape[1]:
            raise ValueError(f"expected a square operator, got shape {operator.shape}")
        partition = operator.partition
        centroids, points = partition.centroids, np.zeros(len(partition))
        unit = np.sqrt(GROUP * np.median(partition.areas))
        tree = Quadtree.build(centroids, points, centroids, 2 * GROUP, 1.0, unit)
        cells = tree.cells  # the same order as that of the points
        near, _, _ = near_lists(tree, centroids[:, cells], points, len(partition))
        group = np.repeat(np.arange(len(near.boxes)), near.counts)
        middle, half = tree.middle[:, near.boxes], tree.half[near.boxes]
        away = np.abs(centroids[:, cells[near.items]] - middle[:, group]).max(axis=0)
        kept = away <= (1 + OVERLAP) * half[group]
        items, group = near.items[kept], group[kept]
        items = items[np.lexsort((items, group))]
        starts = np.searchsorted(group, np.arange(len(half) + 1))
        rows = tree.targets[:, near.boxes]
        return cls(cells, _inverses(operator, cells, rows, starts, items))

    def __matmul__(self, w: ndarray) -> ndarray:
        """Approximate pressures under settlements ``w`` of shape (n,)."""
        inner = np.zeros(len(w))
        with Threads() as run:
            self.blocks.add_product(w[self.cells], inner, run)
        out = np.empty_like(inner)
        out[self.cells] = inner
        return out


def _inverses(
    operator: InfluenceOperator, cells: ndarray, rows: ndarray, starts: ndarray, items: ndarray
) -> Blocks:
    """Rows of inverses of what acts nearby: c / r and the edge correction."""
    direct = NearField.build(operator.substrate, operator.partition, operator.weights, cells)
    near = csr_matrix(operator.shape)
    if operator.correction is not None:
        near = operator.correction.near[cells][:, cells].tocsr()
    blocks = Blocks(rows, starts, items, np.empty(0))
    offsets = blocks.offsets
    values = np.empty(offsets[-1], np.float32)
    x = operator.x[:, cells]

    def work(k: slice) -> None:
        ends = starts[k.start : k.stop + 1]
        each = np.stack([ends[:-1], ends[1:]]) - ends[0]
        local = np.empty(int(np.sum(np.diff(ends) ** 2)))
        direct.fill(x[:, items[ends[0] : ends[-1]]], each, (ends, items), local)
        part = values[offsets[k.start] : offsets[k.stop]]
        _invert(rows[:, k], ends, items, near.indptr, near.indices, near.data, local, part)

    _in_blocks(work, rows.shape[1])
    return Blocks(rows, starts, items, values)


@vectorised
def _invert(rows, starts, items, indptr, indices, data, local, values):
    """Rows of the inverses of square blocks, after sparse entries are added to these."""
    at, out = 0, 0
    for block in range(rows.shape[1]):
        some = items[starts[block] : starts[block + 1]]
        size, own = some.shape[0], rows[1, block] - rows[0, block]
        first = np.searchsorted(some, rows[0, block])
        # rows of the inverse solve equations with the transpose
        m, y = np.empty((size, size)), np.zeros((size, own))
        for i in range(size):
            for j in range(size):
                m[j, i] = local[at + i * size + j]
            for k in range(indptr[some[i]], indptr[some[i] + 1]):
                j = np.searchsorted(some, indices[k])
                if j < size and some[j] == indices[k]:
                    m[j, i] += data[k]
        for i in range(own):
            y[first + i, i] = 1.0
        for k in range(size):
            pivot = k
            for i in range(k + 1, size):
                if abs(m[i, k]) > abs(m[pivot, k]):
                    pivot = i
            for j in range(k, size):
                m[k, j], m[pivot, j] = m[pivot, j], m[k, j]
            for j in range(own):
                y[k, j], y[pivot, j] = y[pivot, j], y[k, j]
            for i in range(k + 1, size):
                f = m[i, k] / m[k, k]
                for j in range(k + 1, size):
                    m[i, j] -= f * m[k, j]
                for j in range(own):
                    y[i, j] -= f * y[k, j]
        for k in range(size - 1, -1, -1):
            for i in range(k + 1, size):
                f = m[k, i]
                for j in range(own):
                    y[k, j] -= f * y[i, j]
            for j in range(own):
                y[k, j] /= m[k, k]
        for i in range(own):
            for j in range(size):
                values[out] = y[j, i]
                out += 1
        at += size * size


def solve_many(
    operator: InfluenceOperator,
    rhs: ndarray,
    rtol: float = 1e-6,
    progress: bool = False,
    *,
    preconditioner: Preconditioner | None = None,
) -> tuple[ndarray, tuple[tuple[float, ...], ...], bool, str]:
    """Pressures under which the collocation points settle as given.

    Parameters
    ----------
    operator : InfluenceOperator
        From cells to the collocation point of each.
    rhs : (n, k) array of float
        Settlements, positive into the ground; each column is one problem.
    rtol : float
        Residual allowed, relative to the right-hand side, in the 2-norm.
    progress : bool
        Whether to show a progress bar.
    preconditioner : Preconditioner, optional
        Of an earlier solution with the same cells.

    Returns
    -------
    solution : (n, k) array of float
        Mean pressures.
    history : tuple of tuples of float
        Relative residual of each column before each iteration and after the last.
    success : bool
        Whether all residuals have become as small as asked for.
    message : str
        Iterations and residuals; if not successful, which columns failed.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace
    >>> basis = DualMesh.from_mesh(MeshTri.init_circle(4)).basis()
    >>> operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis)
    >>> p, history, success, message = solve_many(operator, np.ones((545, 1)))
    >>> success
    True
    >>> bool(abs(basis.partition.areas @ p[:, 0] - 2) < 0.01)  # exact for the circle: 2
    True
    """
    rhs = np.asarray(rhs, dtype=float)
    if rhs.ndim != 2 or rhs.shape[0] != operator.shape[0]:
        raise ValueError(
            f"expected right-hand sides of shape ({operator.shape[0]}, k), got {rhs.shape}"
        )
    if not np.isfinite(rhs).all():
        bad = np.nonzero(~np.isfinite(rhs).all(axis=0))[0]
        raise ValueError(f"expected finite right-hand sides; the first that is not: {bad[0]}")
    if not 0 < rtol < 1:
        raise ValueError(f"expected a tolerance between 0 and 1, got rtol={rtol}")
    inverse = Preconditioner.build(operator) if preconditioner is None else preconditioner
    solution, histories = np.zeros_like(rhs), []
    with tqdm(total=rhs.shape[1], desc="GMRES", unit="column", disable=not progress) as bar:
        for k, b in enumerate(rhs.T):
            solution[:, k], history = _gmres(operator, inverse, b, rtol, bar)
            histories.append(history)
            bar.update()
    failed = [k for k, history in enumerate(histories) if history[-1] > 1.01 * rtol]
    counts = ", ".join(f"{len(h) - 1} iterations to {h[-1]:.1e}" for h in histories)
    message = f"residuals after {counts}"
    if failed:
        message += f"; columns {failed} have not converged to {rtol:g}"
    return solution, tuple(histories), not failed, message


def _gmres(operator, inverse, b: ndarray, rtol: float, bar) -> tuple[ndarray, tuple[float, ...]]:
    """GMRES, preconditioned from the right: its residuals are those of the equations."""
    scale = float(np.linalg.norm(b))
    if scale == 0.0:
        return np.zeros_like(b), (0.0,)
    history = [1.0]

    def note(residual: float) -> None:
        history.append(float(residual))
        bar.set_postfix_str(f"residual {residual:.1e}")

    product = LinearOperator(operator.shape, lambda y: operator @ (inverse @ y), dtype=float)
    # in units of the right-hand side, whatever those of the user
    y, _ = gmres(
        product,
        b / scale,
        rtol=rtol,
        atol=0.0,
        restart=min(RESTART, MOST),
        maxiter=-(-MOST // RESTART),
        callback=note,
        callback_type="pr_norm",
    )
    x = scale * (inverse @ y)
    history[-1] = float(np.linalg.norm(b - operator @ x)) / scale
    return x, tuple(history)
