"""Linear maps of the fast summation as they are kept: sparse blocks, matrices of many boxes."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from ...kernels.compiled import inputs
from ...kernels.once import computed_once
from .loops import Layout, block_products, translate

Run = Callable[..., None]


@dataclass(frozen=True, eq=False)
class SparseBlocks:
    """A sparse matrix of dense blocks: P2M, P2P, M2P and P2L.

    Attributes
    ----------
    layout : Layout
    values : array of float
        The entries of all blocks, one block after the other.
    """

    layout: Layout
    values: ndarray

    def add_product(self, vectors: ndarray, out: ndarray, run: Run) -> None:
        """Add the blocks times ``vectors`` to ``out``, both with a vector in each row."""
        args = self.layout, *inputs(self.values, vectors), out
        run(lambda k: block_products(k.start, k.stop, *args), len(self.layout.starts) - 1)

    @property
    def nbytes(self) -> int:
        """Memory."""
        return self.values.nbytes + sum(a.nbytes for a in self.layout)


@dataclass(frozen=True, eq=False)
class Translation:
    """From expansions of some boxes to those of the boxes of a level: M2M, M2L and L2L.

    Attributes
    ----------
    first : int
        The first box of the level.
    sources : (nboxes, k) array of int
        Boxes from which each takes, -1 for none.
    matrices : (k, terms, terms) array of float
        One for each column of ``sources``.
    """

    first: int
    sources: ndarray
    matrices: ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "sources", np.ascontiguousarray(self.sources, np.int32))
        object.__setattr__(self, "matrices", np.ascontiguousarray(self.matrices))

    @computed_once
    def _single(self) -> ndarray:
        """The matrices in single precision."""
        return self.matrices.astype(np.float32)

    def add(self, given: ndarray, out: ndarray, run: Run) -> None:
        """Add what becomes of ``given`` to ``out``, of shapes (s, nboxes, terms)."""
        single = given.dtype == np.float32
        matrices = self._single if single else self.matrices
        args = self.first, self.sources, matrices, given, out
        each = len(given) * matrices.size // 4  # some billions of multiplications a second
        run(lambda k: translate(k.start, k.stop, *args), len(self.sources), each)

    def cut(self, terms: int) -> "Translation":
        """Of the first terms only."""
        return replace(self, matrices=self.matrices[:, :terms, :terms])

    @property
    def nbytes(self) -> int:
        """Memory that depends on the number of boxes."""
        return self.sources.nbytes
