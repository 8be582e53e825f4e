"""Iterative solution of the equations of contact for several right-hand sides: GMRES."""

import numpy as np
from numpy import ndarray
from scipy.sparse.linalg import LinearOperator, gmres
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from .influence_operator import InfluenceOperator
from .preconditioner import Preconditioner

#: directions that GMRES keeps before it starts anew
RESTART = 60
#: iterations in all
MOST = 300


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
    bar = tqdm(total=rhs.shape[1], desc="GMRES", unit="column", disable=not progress)
    # threads of BLAS go on waiting for work, in the way of those of the products
    with bar, threadpool_limits(1, user_api="blas"):
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
    y, failed = gmres(
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
    if failed:  # otherwise the residual has been found to be no larger than asked for
        history[-1] = float(np.linalg.norm(b - operator @ x)) / scale
    return x, tuple(history)
