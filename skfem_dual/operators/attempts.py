"""What stands for the matrix of an operator, made again until its error is small enough."""

from collections.abc import Callable
from functools import partial
from typing import cast

import numpy as np
from numpy import ndarray

from ..errors import ConvergenceError
from ..grids.lattice import Lattice
from ..grids.partition import Partition
from ..ground.periodic import PeriodicGround
from .dense import moment_matrix
from .entries import ALIKE, EXACT, NEW, SAMPLES, SHORT, Entries, Sample, some_rows
from .fmm.summation import FastSummation
from .toeplitz import BlockToeplitz

#: the largest tolerance
COARSEST = 1e-2
#: the error of sampled rows in the 2-norm may be so many times the tolerance
ROWS = 10.0
#: tolerance of a first attempt with a remainder beside c / r
REMAINDER = 0.7
#: of more cells than the first no more vectors than the second are multiplied together: what is
#: between takes memory
MANY, BLOCK = 500_000, 3
#: the least tolerance of an attempt; in smaller ones errors of rounding grow
FINEST = 1e-11
#: attempts to reach a tolerance
ATTEMPTS = 5

Kept = ndarray | FastSummation | BlockToeplitz


def within(
    entries: Entries, method: str, rtol: float, known: FastSummation | None
) -> tuple[Kept, float, float]:
    """What is made with tolerances from ``rtol`` on down until its error is less; its errors.

    The first attempt of a fast summation is by one that is ``known`` to other points.
    """
    if isinstance(entries.substrate, PeriodicGround):
        return _periodic(entries.substrate, entries.partition)
    make = _MAKERS[method]
    rows = max(SAMPLES, min(NEW, SHORT // len(entries.partition)))
    sample = Sample.from_entries(entries, ALIKE if method == "toeplitz" else rows)
    tolerance = rtol
    if method == "toeplitz":  # its errors are those of rounding and of the exact rows
        rtol = max(rtol, EXACT, cast(Lattice, entries.partition.lattice).blur)
    elif rtol >= EXACT and entries.substrate.remainder is not None:  # and errors add up
        tolerance *= REMAINDER * min(1.0, sample.least)
    kept: Kept
    best = float("inf")
    ground = entries.substrate, entries.partition, entries.x, entries.weights
    for attempt in range(ATTEMPTS):
        if attempt == 0 and method == "fast" and known is not None:
            kept = known.at(*ground)
        else:
            kept = make(entries, tolerance, rtol)
        error, row_error = sample.errors(partial(product, entries, kept))
        worst = max(error, row_error / ROWS)
        best = min(best, worst)
        if worst <= rtol or rtol < EXACT:
            return kept, error, row_error
        tolerance *= min(0.5, 0.7 * rtol / worst)
        del kept  # gives back its memory first
        if tolerance < FINEST:
            break
    wider = f"rtol={1.5 * best:.1e}, or " if 1.5 * best <= COARSEST else ""
    raise ConvergenceError(
        f"expected an error up to rtol={rtol:g}, the {method} summation reaches {best:.1e}. "
        f'Remedy: {wider}method="dense" with rtol=0'
    )


def _dense(entries: Entries, tolerance: float, rtol: float) -> ndarray:
    """The matrix, exact if ``rtol`` asks for that."""
    if rtol < EXACT:
        matrix = entries.matrix()
    else:
        cells = entries.substrate, entries.partition, entries.x, entries.weights
        matrix = moment_matrix(*cells, tolerance)
        if entries.correction is not None:  # the dipoles are in it
            near = entries.correction.near.tocoo()
            matrix[near.row, near.col] += near.data
        if entries.sloping is not None and entries.slopes is not None:
            entries.sloping.add_to(matrix, entries.slopes)
    matrix.setflags(write=False)
    return matrix


def _fast(entries: Entries, tolerance: float, rtol: float) -> FastSummation:
    cells = entries.substrate, entries.partition, entries.x, entries.weights
    return FastSummation.from_partition(*cells, tolerance)


def _periodic(ground: PeriodicGround, partition: Partition) -> tuple[Kept, float, float]:
    """The products with their errors of rounding."""
    kept = BlockToeplitz.from_period(ground, cast(Lattice, partition.lattice))
    numbers = some_rows(len(partition), len(partition), ALIKE)
    error, row_error = Sample.from_rows(numbers, kept.rows(numbers)).errors(kept.__matmul__)
    return kept, error, row_error


def _transforms(entries: Entries, tolerance: float, rtol: float) -> BlockToeplitz:
    lattice = cast(Lattice, entries.partition.lattice)
    return BlockToeplitz.from_substrate(entries.substrate, lattice)


_MAKERS: dict[str, Callable[[Entries, float, float], Kept]] = {
    "dense": _dense,
    "fast": _fast,
    "toeplitz": _transforms,
}


def product(entries: Entries, kept: Kept, q: ndarray, rough: bool = False) -> ndarray:
    """Settlements under pressures of shape (n,) or (n, k)."""
    if isinstance(kept, (ndarray, BlockToeplitz)):
        return kept @ q
    if q.ndim == 2 and q.shape[1] > BLOCK and len(q) > MANY:
        blocks = [q[:, k : k + BLOCK] for k in range(0, q.shape[1], BLOCK)]
        return np.hstack([product(entries, kept, block, rough) for block in blocks])
    slopes = None if entries.slopes is None else entries.slopes.of_rows
    return entries.summed(kept, q, slopes, rough)
