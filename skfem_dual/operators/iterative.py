"""Iterative solution of the equations of contact for several right-hand sides: GMRES.

Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856, preconditioned from the right, so that
its residuals are those of the equations. Every right-hand side has its own search; the products
for which they ask are made together. Where residuals are not to be small, directions are kept in
single precision: Aliaga et al., Compressed basis GMRES, Int. J. High Perform. Comput. Appl. 37
(2023) 82.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias, cast

import numpy as np
from numpy import ndarray

from ..arguments import checked_array, checked_instance, checked_integer, checked_number
from ..ground.stratified import Stratified
from ..kernels.limits import limited_threads
from ..kernels.progress import Bar, progress_bar
from .influence_operator import RTOL, InfluenceOperator
from .preconditioner import approximate_inverse

#: directions that GMRES keeps before it starts anew
RESTART = 60
#: iterations in all
MOST = 300
#: relative residuals that rounding to single precision hardly changes
ROUGH = 1e-6
#: but on ground in layers, where parts of a settlement cancel: by so many times what is allowed,
#: which so many corrections take away
SPOILT, CORRECTIONS = 3.0, 3


Search: TypeAlias = Generator[ndarray, Any, tuple[ndarray, tuple[float, ...]]]


class Product(Protocol):
    """What multiplies vectors: a matrix, an operator, or an approximate inverse of one."""

    def __matmul__(self, q: ndarray, /) -> ndarray: ...


class Operator(Product, Protocol):
    """A square matrix that need not be formed."""

    @property
    def shape(self) -> tuple[int, ...]: ...


@dataclass(frozen=True, eq=False)
class IterativeSolution:
    """What iterations have found.

    Attributes
    ----------
    solution : (n, k) array of float
        Mean pressures, a column for each right-hand side.
    residuals : tuple of tuples of float
        Relative residual of each column before each iteration and after the last.
    iterations : tuple of int
        Iterations for each column.
    success : bool
        Whether all residuals have become as small as asked for.
    message : str
        Iterations and residuals; if not successful, which columns failed.
    """

    solution: ndarray
    residuals: tuple[tuple[float, ...], ...]
    iterations: tuple[int, ...]
    success: bool
    message: str


def solve_many(
    operator: Operator,
    rhs: ndarray,
    rtol: float = RTOL,
    progress: bool = False,
    *,
    preconditioner: Product | None = None,
    most: int | None = None,
) -> IterativeSolution:
    """Pressures under which the collocation points settle as given.

    Parameters
    ----------
    operator : InfluenceOperator or YieldingOperator
        From cells to the collocation point of each.
    rhs : (n, k) array of float
        Settlements, positive into the ground; each column is one problem.
    rtol : float
        Residual allowed, relative to the right-hand side, in the 2-norm.
    progress : bool
        Whether to show a progress bar.
    preconditioner : Preconditioner or Convolution, optional
        Approximate inverse, as of an earlier solution with the same cells; by default that of
        an `InfluenceOperator`.
    most : int, optional
        Iterations for each column at most, by default 300.

    Returns
    -------
    IterativeSolution
        With ``success=False`` if some residuals are larger.

    Raises
    ------
    ValueError
        If the operator is not square, or the right-hand sides or the tolerance do not fit.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace
    >>> basis = DualMesh.from_mesh(MeshTri.init_circle(4)).basis()
    >>> operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis)
    >>> found = solve_many(operator, np.ones((545, 1)))
    >>> found.success
    True
    >>> force = basis.partition.areas @ found.solution[:, 0]
    >>> print(f"{force:.2f}")  # exact for the circle: 2
    2.00
    """
    rhs = checked_array("rhs", rhs, (operator.shape[0], "k"), each="column", order="K")
    rtol = checked_number("rtol", rtol, above=0, below=1)
    most = MOST if most is None else checked_integer("most", most, at_least=1)
    inverse = preconditioner
    if inverse is None:
        remedy = "give a preconditioner of it"
        checked_instance("operator", operator, InfluenceOperator, remedy)
        inverse = approximate_inverse(cast(InfluenceOperator, operator))
    dtype = np.float32 if rtol >= ROUGH else np.float64
    product = operator.__matmul__
    if rtol >= ROUGH and isinstance(operator, InfluenceOperator):
        product = operator.roughly

    def sought(b: ndarray, rtols: ndarray) -> tuple[ndarray, list[tuple[float, ...]]]:
        searches = [_search(*each, most, bar, dtype) for each in zip(b.T, rtols)]
        found = _together(product, inverse, searches, bar)
        if not found:
            return np.zeros_like(b), []
        vectors, residuals = zip(*found)
        return _answered(inverse, vectors), list(residuals)

    # threads of BLAS go on waiting for work, in the way of those of the products
    with (
        progress_bar(progress, "GMRES", "column", rhs.shape[1]) as bar,
        limited_threads(1, "blas"),
    ):
        solution, residuals = sought(rhs, np.full(rhs.shape[1], rtol))
        if rtol >= ROUGH and _may_cancel(operator):
            _correct(operator, rhs, rtol, sought, solution, residuals)
    solution.setflags(write=False)
    failed = [k for k, history in enumerate(residuals) if history[-1] > 1.01 * rtol]
    iterations = tuple(len(history) - 1 for history in residuals)
    counts = ", ".join(
        f"{n} iterations to {history[-1]:.1e}" for n, history in zip(iterations, residuals)
    )
    message = f"residuals after {counts}"
    if failed:
        message += f"; columns {failed} have not converged to {rtol:g}"
    return IterativeSolution(solution, tuple(residuals), iterations, not failed, message)


def _may_cancel(operator: Operator) -> bool:
    """Whether settlements may be small differences of what is rounded."""
    return isinstance(operator, InfluenceOperator) and isinstance(operator.substrate, Stratified)


def _correct(
    operator: Operator,
    rhs: ndarray,
    rtol: float,
    sought: Callable[[ndarray, ndarray], tuple[ndarray, list[tuple[float, ...]]]],
    solution: ndarray,
    residuals: list[tuple[float, ...]],
) -> None:
    """Take from converged columns what single precision has spoilt, by products in double; the
    residuals of those that keep it are the true ones."""
    sizes = np.linalg.norm(rhs, axis=0)
    for rounds in range(CORRECTIONS, -1, -1):
        left = rhs - operator @ solution
        off = np.linalg.norm(left, axis=0) / np.where(sizes > 0, sizes, 1.0)
        spoilt = off > SPOILT * rtol
        again = [k for k in np.nonzero(spoilt)[0] if residuals[k][-1] <= 1.01 * rtol]
        if not again:
            return
        if rounds:
            step, more = sought(left[:, again], rtol / off[again])
            solution[:, again] += step
            for k, history in zip(again, more):
                residuals[k] += tuple(off[k] * r for r in history[1:])
    for k in again:
        residuals[k] = (*residuals[k][:-1], float(off[k]))


def _together(
    product: Callable[[ndarray], ndarray], inverse: Product, searches: "list[Search]", bar: Bar
) -> list[tuple[ndarray, tuple[float, ...]]]:
    """What searches find, which get the products that they ask for all at a time."""
    found: dict[int, tuple[ndarray, tuple[float, ...]]] = {}
    answers: dict[int, ndarray | None] = dict.fromkeys(range(len(searches)))
    while answers:
        asked: dict[int, ndarray] = {}
        for k, answer in answers.items():
            try:
                asked[k] = searches[k].send(answer)
            except StopIteration as end:
                found[k] = end.value
                bar.update()
        answers, answer = {}, None  # gives back its memory first
        if asked:
            pressures = _answered(inverse, list(asked.values()))
            answers = dict(zip(asked, np.ascontiguousarray(product(pressures).T)))
            del pressures
    return [found[k] for k in range(len(searches))]


def _answered(inverse: Product, vectors: Sequence[ndarray]) -> ndarray:
    """What an approximate inverse makes of vectors, in columns."""
    return inverse @ np.stack(vectors).T


def _search(b: ndarray, rtol: float, most: int, bar: Bar, dtype: type) -> "Search":
    """GMRES for one right-hand side, a generator that asks for products.

    It yields vectors y, takes ``A M y`` for each, M the approximate inverse, and returns the y
    under which that is nearly b, with the relative residuals. Directions are kept as ``dtype``.
    """
    largest = float(np.abs(b).max(initial=0.0))  # whose square may be no number
    scale = largest * float(np.linalg.norm(b / largest)) if largest > 0.0 else 0.0
    if scale == 0.0:
        return np.zeros_like(b), (0.0,)
    # in units of the right-hand side, whatever those of the user
    history, y = [1.0], None
    while True:
        rest = b / scale if y is None else b / scale - (yield y)
        first = float(np.linalg.norm(rest))
        basis: list[ndarray] = [(rest / first).astype(dtype)]
        triangle = np.zeros((RESTART + 1, RESTART))
        del rest
        for j in range(min(RESTART, most + 1 - len(history))):
            w = yield basis[j]
            for i, v in enumerate(basis):
                triangle[i, j] = v @ w
                w -= triangle[i, j] * v
            triangle[j + 1, j] = np.linalg.norm(w)
            given, small = first * np.eye(j + 2)[0], triangle[: j + 2, : j + 1]
            shares = np.linalg.lstsq(small, given, rcond=None)[0]
            history.append(float(np.linalg.norm(given - small @ shares)))
            bar.set_postfix_str(f"residual {history[-1]:.1e}")
            if history[-1] <= rtol or triangle[j + 1, j] == 0.0:
                break
            basis.append((w / triangle[j + 1, j]).astype(dtype))
            del w  # gives back its memory while others ask
        y = np.zeros_like(b) if y is None else y
        for share, v in zip(shares, basis):
            y += share * v
        if history[-1] <= rtol or len(history) > most:
            y *= scale
            return y, tuple(history)
