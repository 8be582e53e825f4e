"""M2L between families of four boxes of one parent, by parities.

A family is its own image in the axes through its middle. Sums and differences of the expansions
of its boxes, each term with the sign that it has in the image, are even or odd there: of four
parities, one for each bit of 0 to 3, the lower for x, the upper for y. Families at mirrored places
act by matrices that differ only in the signs of what is odd. So one matrix does for the sum of
what both hold, or for the difference: a quarter of the products that single families take.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ...kernels.compiled import inputs, vectorised
from ...kernels.once import computed_once
from .chebyshev import Compressed
from .linear_maps import Run
from .quadtree import BESIDE, OFFSETS

#: families whose expansions are multiplied together, over the number of vectors
TOGETHER = 32
#: which of `BESIDE` the matrices are of: to the right, above, and both
_RIGHT, _ABOVE, _CORNER = (BESIDE.tolist().index(way) for way in ([1, 0], [0, 1], [1, 1]))
#: of each parity its sign in each box of a family, ``SIGNS[parity, box]``
SIGNS = np.kron([[1, 1], [1, -1]], [[1, 1], [1, -1]])
#: by which of these the sums of `_put_sums` act, and in which bits their parity differs from that
#: on which they act
_WHICH = np.array([_RIGHT, _ABOVE, _CORNER, _CORNER, _CORNER, _RIGHT, _ABOVE, _CORNER])
_DIFFER = np.array([1, 2, 1, 2, 3, 0, 0, 0])
#: which of `OFFSETS` leads to each box of a family at each of `BESIDE` from each box, in the last
#: place, of another; the number beyond the last where both are adjacent
_QUARTERS = np.array([(0, 0), (1, 0), (0, 1), (1, 1)])
_WAYS = (2 * BESIDE[:, None] + _QUARTERS)[:, :, None] - _QUARTERS
_SAME = (_WAYS[..., None, :] == OFFSETS).all(axis=-1)
_NUMBERS = np.where(_SAME.any(axis=-1), _SAME.argmax(axis=-1), len(OFFSETS))


class Outer(NamedTuple):
    """From expansions of boxes to what is kept of them, or back.

    Attributes
    ----------
    matrix : (terms, r) or (r, terms) array of float
    signs : (4, r) array of float
        Of what is kept, in each box of a family those of its parity.
    """

    matrix: ndarray
    signs: ndarray

    @classmethod
    def of(cls, matrix: ndarray, parities: ndarray, dtype: type = float) -> Self:
        """Of what has these parities."""
        return cls(*inputs(matrix.astype(dtype), SIGNS[parities].T.astype(dtype)))


@dataclass(frozen=True, eq=False)
class FamilyTranslation:
    """The M2L of one level, with matrices ``left @ core @ right`` as by `compressed`.

    Attributes
    ----------
    first : int
        The first box of the level.
    sources : (nfamilies, len(BESIDE)) array of int
        The families at each of `BESIDE`; their number, that of none, where there is none.
    matrices : (4, 8, r, s) array of float
        From the sums of families, in the order of `_put_sums`, to each parity.
    outer : Compressed
        What they stand between; without the core, they are of families.
    """

    first: int
    sources: ndarray
    matrices: ndarray
    outer: Compressed

    @classmethod
    def of(cls, first: int, beside: ndarray, factors: Compressed) -> Self:
        """Of families ``beside`` each, -1 for none, see `Quadtree.families`."""
        core, gives, takes = factors.core, SIGNS[factors.of_left].T, SIGNS[factors.of_right].T
        blocks = np.append(core, np.zeros_like(core[:1]), axis=0)[_NUMBERS].swapaxes(2, 3)
        # terms with the signs of their parities in each box
        blocks = gives[:, :, None, None] * blocks * takes
        count, _, r, _, s = blocks.shape
        blocks = blocks.swapaxes(2, 3).reshape(count, 16, r * s)
        turned = (np.kron(SIGNS, SIGNS) / 16 @ blocks).reshape(count, 4, 4, r, s)
        parities = np.arange(4)[:, None]
        # the parity of what acts, then of what comes out
        found = turned[_WHICH, parities ^ _DIFFER, parities]
        sources = np.where(beside >= 0, beside, len(beside)).astype(np.int32)
        return cls(first, sources, found, factors._replace(core=core[:0]))

    @property
    def boxes(self) -> slice:
        """Those of the level."""
        return slice(self.first, self.first + 4 * len(self.sources))

    @computed_once
    def _double(self) -> tuple[Outer, ndarray, Outer]:
        return self._as(float)

    @computed_once
    def _single(self) -> tuple[Outer, ndarray, Outer]:
        return self._as(np.float32)

    def _as(self, dtype: type) -> tuple[Outer, ndarray, Outer]:
        """What comes before, the matrices and what comes after, as kernels take them."""
        left, _, right, *parities = self.outer
        (matrices,) = inputs(self.matrices.reshape(4, -1, right.shape[0]).astype(dtype))
        of_left, of_right = parities
        return Outer.of(left, of_left, dtype), matrices, Outer.of(right, of_right, dtype)

    def turned(self, multipole: ndarray, run: Run) -> ndarray:
        """What is kept of multipole expansions (s, nboxes, terms), of each family by parities,
        (nfamilies + 1, 4, s, r); the last family is none and holds zeros."""
        before, *_ = self._single if multipole.dtype == np.float32 else self._double
        families, kept = len(self.sources), before.signs.shape[1]
        out = np.empty((families + 1, 4, len(multipole), kept), multipole.dtype)
        out[-1] = 0.0
        args = self.first, *before, *inputs(multipole), out
        run(lambda k: turn(k.start, k.stop, *args), families)
        return out

    def add(self, turned: ndarray, local: ndarray, run: Run) -> None:
        """Add what becomes of these to local expansions (s, nboxes, terms)."""
        _, matrices, after = self._single if turned.dtype == np.float32 else self._double
        args = self.first, self.sources, matrices, *after, *inputs(turned), local
        run(lambda k: translate_families(k.start, k.stop, *args), len(self.sources))

    def cut(self, parities: ndarray) -> "FamilyTranslation":
        """Of the first terms only, with these parities: so few that they are not compressed."""
        terms, own = len(parities), np.eye(len(parities))
        left, right = self.outer.left[:terms], self.outer.right[:, :terms]
        matrices = left @ self.matrices @ right
        outer = Compressed(own, self.outer.core, own, parities, parities)
        return replace(self, matrices=matrices, outer=outer)

    @property
    def nbytes(self) -> int:
        """Memory that depends on the number of boxes."""
        return self.sources.nbytes


@vectorised
def turn(begin, end, first, matrix, signs, multipole, out):
    """Put expansions of the boxes of families times a matrix, by parities."""
    sets, kept = multipole.shape[0], matrix.shape[1]
    product = np.empty((4 * TOGETHER, kept), matrix.dtype)
    for start in range(begin, end, TOGETHER):
        count = min(TOGETHER, end - start)
        box = first + 4 * start
        for s in range(sets):
            np.dot(multipole[s][box : box + 4 * count], matrix, product[: 4 * count])
            for f in range(count):
                for j in range(kept):
                    a, b = product[4 * f, j], signs[1, j] * product[4 * f + 1, j]
                    c, d = signs[2, j] * product[4 * f + 2, j], signs[3, j] * product[4 * f + 3, j]
                    out[start + f, 0, s, j] = (a + b) + (c + d)
                    out[start + f, 1, s, j] = (a - b) + (c - d)
                    out[start + f, 2, s, j] = (a + b) - (c + d)
                    out[start + f, 3, s, j] = (a - b) - (c - d)


@vectorised
def translate_families(begin, end, first, sources, matrices, matrix, signs, turned, out):
    """Add what families beside make to the expansions of boxes, from parities."""
    sets, terms = turned.shape[2:]
    height, full = matrix.shape
    together = max(TOGETHER // sets, 1)
    number = np.empty(together, np.int64)
    sums = np.empty((4, together * sets, 8, terms), turned.dtype)
    rows = sums.reshape(4, together * sets, 8 * terms)
    product = np.empty((4, together * sets, height), turned.dtype)
    made = np.empty((together * sets * 4, height), turned.dtype)
    added = np.empty((together * sets * 4, full), turned.dtype)
    pairs = np.empty((1, 4, 1, terms), turned.dtype)
    for start in range(begin, end, together):
        count = 0
        for family in range(start, min(start + together, end)):
            if sources[family].min() < sources.shape[0]:
                number[count] = family
                for s in range(sets):
                    _put_sums(sources[family], turned, s, count * sets + s, pairs, sums)
                count += 1
        if count == 0:
            continue
        vectors = count * sets
        for p in range(4):
            np.dot(rows[p, :vectors], matrices[p], product[p, :vectors])
        for i in range(vectors):
            for j in range(height):
                a, b, c, d = product[0, i, j], product[1, i, j], product[2, i, j], product[3, i, j]
                made[4 * i, j] = (a + b) + (c + d)
                made[4 * i + 1, j] = signs[1, j] * ((a - b) + (c - d))
                made[4 * i + 2, j] = signs[2, j] * ((a + b) - (c + d))
                made[4 * i + 3, j] = signs[3, j] * ((a - b) - (c - d))
        np.dot(made[: 4 * vectors], matrix, added[: 4 * vectors])
        for i in range(vectors):
            box, s = first + 4 * number[i // sets], i % sets
            for k in range(4):
                for j in range(full):
                    out[s, box + k, j] += added[4 * i + k, j]


@vectorised
def _put_sums(beside, given, s, row, pairs, sums):
    """Put sums and differences of what families at mirrored places hold, those of each parity
    where they act.

    Differences to the right and left, of above and below, and of the four corners in x, in y, in
    both; then the sums of each. They are the greatest: in single precision they come last.
    """
    for p in range(4):  # in the order of BESIDE
        one, two = (beside[6], p, s), (beside[1], p, s)
        _butterfly(given, one, two, sums, (p, row, 5), (p ^ 1, row, 0))
        one, two = (beside[4], p, s), (beside[3], p, s)
        _butterfly(given, one, two, sums, (p, row, 6), (p ^ 2, row, 1))
        one, two = (beside[7], p, s), (beside[2], p, s)
        _butterfly(given, one, two, pairs, (0, 0, 0), (0, 1, 0))
        one, two = (beside[5], p, s), (beside[0], p, s)
        _butterfly(given, one, two, pairs, (0, 2, 0), (0, 3, 0))
        one, two = (0, 0, 0), (0, 2, 0)
        _butterfly(pairs, one, two, sums, (p, row, 7), (p ^ 2, row, 3))
        one, two = (0, 1, 0), (0, 3, 0)
        _butterfly(pairs, one, two, sums, (p ^ 1, row, 2), (p ^ 3, row, 4))


@vectorised
def _butterfly(given, one, two, out, plus, minus):
    """Put the sum and the difference of two rows into two others."""
    a, b, c = one
    d, e, f = two
    g, h, i = plus
    k, m, n = minus
    for j in range(given.shape[3]):
        first, second = given[a, b, c, j], given[d, e, f, j]
        out[g, h, i, j] = first + second
        out[k, m, n, j] = first - second
