"""What operators take, and which of them the machine at hand can hold.

The figures of `estimate` are measured, see ``benchmarks/fast_operator.py``.
"""

from dataclasses import dataclass

from ..kernels.memory import available_memory
from .entries import EXACT
from .fmm.expansions import degree_of
from .fmm.summation import SHORT, SINGLE, order_for

#: products after which the faster operator is to be ready
PRODUCTS = 20
#: bytes a cell takes before its operator, for mesh, dual grid and law of the edge; and after it,
#: for an approximate inverse and iterations
BEFORE, AFTER = 415.0, 270.0
#: bytes of an entry of a dense matrix and of its factors
ENTRY = 16.0
#: remedy where fewer of the cells would fit
FEWER = "at most {most} cells, or a machine with more memory"
#: bytes of matrices that are made without asking
LARGE = 2.0**27
#: what the cells on the edge of a plan take besides, over the root of the number of all
EDGE = 2.9e5


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


def estimate(
    method: str, points: int, cells: int, rtol: float, layered: bool, known: bool = False
) -> Estimate:
    """Estimate of an operator from ``cells`` to ``points``, by what was measured.

    ``layered`` if the influence function has a remainder, ``known`` if the expansions of the
    cells are those of another operator.
    """
    if method == "dense":
        entries = float(points) * cells
        entry = 8e-9 if rtol < EXACT else 2e-9
        return Estimate(8 * entries, (entry + 12e-9 * layered) * entries, 0.8e-9 * entries)
    order = order_for(rtol)
    terms, size = order * (order + 1) / 2, 4 if rtol >= SINGLE else 8
    each, kernels = max(points, cells), 2 if layered else 1
    near = 2 if rtol >= SHORT and not layered else size
    degree = max(5, degree_of(order))
    moments = (degree + 1) * (degree + 2) / 2
    # near entries, moments and near slopes of every cell, expansions of every box, vectors
    kept = 100.0 * near + (moments * kernels + 30) * size + 2 * terms * kernels
    memory = (points if known else each) * kept + each * (365 + 900 * layered)
    setup = 0.1 * kernels + each * (13e-6 + 60e-6 * layered) + each * 2e-8 * terms
    return Estimate(memory, setup, 1e-3 + each * kernels * (2e-7 + 1e-8 * terms))


def whole(cells: int, rtol: float, layered: bool) -> float:
    """Bytes that fast summations take from a mesh to the answer."""
    operator = estimate("fast", cells, cells, rtol, layered).memory
    return operator + (BEFORE + AFTER) * cells + EDGE * cells**0.5


def require_memory(cells: int, rtol: float, layered: bool) -> None:
    """Refuse cells, whose law is known, if operator and answer do not fit into the memory at hand.

    Raises
    ------
    MemoryError
        If they do not.
    """
    needed = whole(cells, rtol, layered) - BEFORE * cells
    refuse_beyond_memory(
        needed, f"{cells} cells take, until their answer with rtol={rtol:g},", FEWER, cells
    )


def transforms(places: int, layered: bool) -> Estimate:
    """Estimate of products by transforms on a regular grid of so many places."""
    return Estimate(180.0 * places, 1e-3 + (2e-7 + 3e-7 * layered) * places, 6e-8 * places)


def choose(
    method: str,
    points: int,
    cells: int,
    rtol: float,
    layered: bool,
    places: int | None = None,
    known: bool = False,
) -> tuple[str, Estimate]:
    """The method, "dense", "fast" or "toeplitz", and what it will take.

    Of ``"auto"`` the last if the cells are on a regular grid of so many ``places``, else what is
    sooner ready for `PRODUCTS` products and fits into the memory; below `EXACT` only a matrix
    will do. ``known`` as of `estimate`.

    Raises
    ------
    MemoryError
        If the memory at hand will not do.
    """
    names = ["dense"] if rtol < EXACT else ["dense", "fast"]
    estimates = {name: estimate(name, points, cells, rtol, layered, known) for name in names}
    memory = available_memory()
    if places is not None:
        estimates["toeplitz"] = transforms(places, layered)
        method = "toeplitz" if method == "auto" else method
    if method == "auto":
        fits = [name for name in names if estimates[name].memory <= memory]
        method = min(
            fits or names[-1:],
            key=lambda name: estimates[name].setup + PRODUCTS * estimates[name].product,
        )
    chosen = estimates[method]
    what = f"{method} summation with rtol={rtol:g} from {cells} cells to {points} points takes"
    faster = f'method="fast" or "auto" with rtol of {EXACT:g} or more'
    coarser = "a coarser mesh, or a machine with more memory"
    refuse_beyond_memory(chosen.memory, what, faster if method == "dense" else coarser)
    return method, chosen


def require_matrix(rows: int, columns: int) -> None:
    """Refuse, with a MemoryError, a large matrix that the memory at hand will not hold."""
    if (needed := 8.0 * rows * columns) > LARGE:
        remedy = "the operator, which multiplies without it, or fewer cells"
        refuse_beyond_memory(needed, f"a matrix of {rows} by {columns} takes", remedy)


def refuse_beyond_memory(needed: float, what: str, remedy: str, cells: int = 0) -> None:
    """Refuse what takes more bytes than are at hand.

    Parameters
    ----------
    needed : float
        Bytes.
    what : str
        "... takes" or "... take", for the message.
    remedy : str
        What to do; ``{most}`` stands for the share of ``cells`` that the memory would do for.
    cells : int, default 0
        How many there are.

    Raises
    ------
    MemoryError
        If they are not there.
    """
    memory = available_memory()
    if needed > memory:
        raise MemoryError(
            f"expected at most {memory / 2**20:.4g} MiB, the memory at hand; {what} "
            f"about {needed / 2**20:.4g} MiB. Remedy: "
            + remedy.format(most=int(memory / needed * cells))
        )
