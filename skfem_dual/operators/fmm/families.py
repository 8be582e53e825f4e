"""M2L between families of four boxes of one parent, by parities.

A family is its own image in the axes through its middle. Sums and differences of the expansions
of its boxes, each term with the sign that it has in the image, are even or odd there: of four
parities, one for each bit of 0 to 3, the lower for x, the upper for y. Families at mirrored places
act by matrices that differ only in the signs of what is odd. So one matrix does for the sum of
what both hold, or for the difference: a quarter of the products that single families take.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from ...kernels.compiled import vectorised
from ...kernels.once import computed_once
from .linear_maps import Run, Translation
from .quadtree import BESIDE

#: families whose expansions are multiplied together, over the number of vectors
TOGETHER = 64
#: which of `BESIDE` the matrices are of: to the right, above, and both
_RIGHT, _ABOVE, _CORNER = (BESIDE.tolist().index(way) for way in ([1, 0], [0, 1], [1, 1]))
#: of each parity its sign in each box of a family, ``SIGNS[parity, box]``
SIGNS = np.kron([[1, 1], [1, -1]], [[1, 1], [1, -1]])
#: by which of these the sums of `_put_sums` act, and in which bits their parity differs from that
#: on which they act
_WHICH = np.array([_RIGHT, _ABOVE, _CORNER, _CORNER, _CORNER, _RIGHT, _ABOVE, _CORNER])
_DIFFER = np.array([1, 2, 1, 2, 3, 0, 0, 0])


@dataclass(frozen=True, eq=False)
class FamilyTranslation:
    """From compressed expansions of families to those of families beside them.

    Attributes
    ----------
    sources : (nfamilies, len(BESIDE)) array of int
        The families at each of `BESIDE`; their number, that of none, where there is none.
    matrices : (4, 8, r, s) array of float
        From the sums of families, in the order of `_put_sums`, to each parity.
    """

    sources: ndarray
    matrices: ndarray

    @classmethod
    def of(cls, beside: ndarray, matrices: ndarray) -> "FamilyTranslation":
        """Of families ``beside`` each, -1 for none, see `Quadtree.families`.

        The ``matrices``, (len(BESIDE), 4, r, 4, s), lead from box to box; their terms have the
        signs of their parities in each box.
        """
        turned = np.einsum("Pa,karbs,Qb->kPrQs", SIGNS, matrices, SIGNS) / 16
        parities = np.arange(4)[:, None]
        # the parity of what acts, then of what comes out
        found = turned[_WHICH, parities ^ _DIFFER, :, parities]
        sources = np.where(beside >= 0, beside, len(beside)).astype(np.int32)
        return cls(sources, np.ascontiguousarray(found))

    @computed_once
    def _single(self) -> ndarray:
        """The matrices in single precision."""
        return self.matrices.astype(np.float32)

    def add(self, given: ndarray, out: ndarray, run: Run) -> None:
        """Add what becomes of expansions (s, nfamilies + 1, 4, terms) to others, (s, nfamilies, 4,
        terms).

        What is given is turned to parities; its last family is none and holds zeros.
        """
        matrices = self._single if given.dtype == np.float32 else self.matrices
        families = len(self.sources)
        run(lambda k: turn(k.start, k.stop, given), families)
        flat = matrices.reshape(4, -1, matrices.shape[3])
        args = self.sources, flat, given, out
        run(lambda k: translate_families(k.start, k.stop, *args), families)

    def expanded(self, left: ndarray, right: ndarray) -> "FamilyTranslation":
        """With ``left`` times every matrix times ``right``, which mix no parities."""
        matrices = np.einsum("tr,pkrs,su->pktu", left, self.matrices, right)
        return replace(self, matrices=matrices)

    @property
    def nbytes(self) -> int:
        """Memory that depends on the number of boxes."""
        return self.sources.nbytes


@dataclass(frozen=True, eq=False)
class CompressedTranslation:
    """The M2L of one level, with matrices ``left @ core @ right`` as by `compressed`.

    Attributes
    ----------
    left, right : Translation
        Within each box of the level, of which terms have the signs of their parities.
    core : FamilyTranslation
        Between families of four of them.
    """

    left: Translation
    core: FamilyTranslation
    right: Translation

    def add(self, multipole: ndarray, local: ndarray, run: Run) -> None:
        """Add what becomes of multipole expansions to local ones."""
        sets, (boxes, _) = len(multipole), self.left.sources.shape
        gives, takes = self.left.matrices.shape[2], self.right.matrices.shape[1]
        taken = np.zeros((sets, boxes + 4, gives), multipole.dtype)  # and a family that is none
        self.left.add(multipole, taken, run)
        given = np.zeros((sets, boxes, takes), multipole.dtype)
        self.core.add(taken.reshape(sets, -1, 4, gives), given.reshape(sets, -1, 4, takes), run)
        del taken  # gives back its memory first
        self.right.add(given, local, run)

    def cut(self, parities: ndarray) -> "CompressedTranslation":
        """Of the first terms only, with these parities: so few that they are not compressed."""
        terms = len(parities)
        left, right = self.left.matrices[0, :terms], self.right.matrices[0, :, :terms]
        signs = SIGNS[parities].T[:, None] * np.eye(terms)
        return CompressedTranslation(
            replace(self.left, matrices=signs),
            self.core.expanded(left, right),
            replace(self.right, matrices=signs),
        )

    @property
    def nbytes(self) -> int:
        """Memory that depends on the number of boxes."""
        return self.left.nbytes + self.core.nbytes + self.right.nbytes


@vectorised
def turn(begin, end, given):
    """Turn terms of the boxes of families to parities, in place."""
    room = np.empty((1, 1, 4, given.shape[3]), given.dtype)
    for s in range(given.shape[0]):
        for f in range(begin, end):
            _turn(given, s, f, room)


@vectorised
def _turn(given, s, f, room):
    """Turn one family; ``room`` of shape (1, 1, 4, terms) is for temporary use."""
    _butterfly(given, (s, f, 0), (s, f, 1), room, (0, 0, 0), (0, 0, 1))
    _butterfly(given, (s, f, 2), (s, f, 3), room, (0, 0, 2), (0, 0, 3))
    _butterfly(room, (0, 0, 0), (0, 0, 2), given, (s, f, 0), (s, f, 2))
    _butterfly(room, (0, 0, 1), (0, 0, 3), given, (s, f, 1), (s, f, 3))


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


@vectorised
def translate_families(begin, end, sources, matrices, given, out):
    """Add what families beside make, from parities to terms of boxes."""
    sets, terms, height = given.shape[0], given.shape[3], matrices.shape[2]
    together = max(TOGETHER // sets, 1)
    number = np.empty(together, np.int64)
    sums = np.empty((4, together * sets, 8, terms), given.dtype)
    rows = sums.reshape(4, together * sets, 8 * terms)
    product = np.empty((together * sets, height), given.dtype)
    made = np.empty((1, together * sets, 4, height), given.dtype)
    pairs = np.empty((1, 1, 4, terms), given.dtype)
    room = np.empty((1, 1, 4, height), given.dtype)
    for start in range(begin, end, together):
        count = 0
        for family in range(start, min(start + together, end)):
            if sources[family].min() < sources.shape[0]:
                number[count] = family
                for s in range(sets):
                    _put_sums(sources[family], given, s, count * sets + s, pairs, sums)
                count += 1
        if count == 0:
            continue
        for p in range(4):
            np.dot(rows[p, : count * sets], matrices[p], product[: count * sets])
            for i in range(count * sets):
                for j in range(height):
                    made[0, i, p, j] = product[i, j]
        for i in range(count * sets):
            _turn(made, 0, i, room)
            family, s = number[i // sets], i % sets
            for p in range(4):
                for j in range(height):
                    out[s, family, p, j] += made[0, i, p, j]


@vectorised
def _put_sums(beside, given, s, row, pairs, sums):
    """Put sums and differences of what families at mirrored places hold, those of each parity
    where they act.

    Differences to the right and left, of above and below, and of the four corners in x, in y, in
    both; then the sums of each. They are the greatest: in single precision they come last.
    """
    for p in range(4):  # in the order of BESIDE
        one, two = (s, beside[6], p), (s, beside[1], p)
        _butterfly(given, one, two, sums, (p, row, 5), (p ^ 1, row, 0))
        one, two = (s, beside[4], p), (s, beside[3], p)
        _butterfly(given, one, two, sums, (p, row, 6), (p ^ 2, row, 1))
        one, two = (s, beside[7], p), (s, beside[2], p)
        _butterfly(given, one, two, pairs, (0, 0, 0), (0, 0, 1))
        one, two = (s, beside[5], p), (s, beside[0], p)
        _butterfly(given, one, two, pairs, (0, 0, 2), (0, 0, 3))
        one, two = (0, 0, 0), (0, 0, 2)
        _butterfly(pairs, one, two, sums, (p, row, 7), (p ^ 2, row, 3))
        one, two = (0, 0, 1), (0, 0, 3)
        _butterfly(pairs, one, two, sums, (p ^ 1, row, 2), (p ^ 3, row, 4))
