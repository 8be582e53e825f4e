"""Irreducible representations of the motions of a plan, and the vectors that belong to each.

Serre, Linear Representations of Finite Groups, 1977: 2.7 for the vectors, 5.1 and 5.3 for the
representations of cyclic and dihedral groups.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix


@dataclass(frozen=True, eq=False)
class Component:
    """Vectors that change under a group like the rows of one irreducible representation.

    Attributes
    ----------
    bases : tuple of (n, size) csr_matrix
        Orthonormal vectors for each row; a symmetric matrix does the same to each.
    first : (orbits + 1,) array of int
        Vectors ``first[o]`` to ``first[o + 1]`` live on orbit ``o``.
    shares : (size, d) array
        Of the products with each basis in the rows of the block.
    twice : bool
        Whether the representation is complex: its conjugate counts as well.
    """

    bases: tuple[csr_matrix, ...]
    first: ndarray
    shares: ndarray
    twice: bool

    def __len__(self) -> int:
        return len(self.shares)

    @classmethod
    def from_representation(
        cls, permutations: ndarray, representatives: ndarray, representation: ndarray
    ) -> "Component":
        """Of unitary matrices of shape (order, d, d), one for each of the permutations."""
        order, d, _ = representation.shape
        n = permutations.shape[1]
        images = permutations[:, representatives]
        orbit, motion = np.empty((2, n), dtype=int)  # from whom, and how
        orbit[images], motion[images] = np.arange(images.shape[1]), np.arange(order)[:, None]
        # on a representative only what the motions that leave it in its place leave alone
        stays, kind = np.unique(images == images[0], axis=1, return_inverse=True)
        kind, count = kind.ravel(), stays.sum(axis=0)
        value, fixed = np.linalg.eigh(np.einsum("gk,gab->kab", stays / count, representation))
        kept, fixed = (value > 0.5)[kind], fixed[kind]
        scale = np.sqrt(d * count / order)[kind][:, None, None]
        vectors = np.einsum("iab,ibt->iat", representation[motion].conj(), (scale * fixed)[orbit])
        cell, t = np.nonzero(kept[orbit])
        column = (np.cumsum(kept) - 1).reshape(kept.shape)[orbit[cell], t]
        shape = n, int(kept.sum())
        return cls(
            tuple(csr_matrix((vectors[cell, a, t], (cell, column)), shape) for a in range(d)),
            np.concatenate([[0], np.cumsum(kept.sum(axis=1))]),
            (fixed.conj() / scale).swapaxes(1, 2)[kept],
            np.iscomplexobj(representation),
        )

    def fill(self, block: ndarray, orbits: slice, rows: ndarray) -> None:
        """Fill the rows of some orbits from those of the full matrix for the representatives."""
        first = self.first[orbits.start : orbits.stop + 1]
        mine = slice(first[0], first[-1])
        block[mine] = 0
        for share, basis in zip(self.shares[mine].T, self.bases):
            block[mine] += share[:, None] * np.repeat(rows @ basis, np.diff(first), axis=0)

    def apply(self, function: Callable[[ndarray], ndarray], q: ndarray) -> ndarray:
        """What a function of the block's columns makes of the part in ``q`` of shape (n, k)."""
        images = function(np.hstack([basis.conj().T @ q for basis in self.bases]))
        parts = np.hsplit(images, len(self.bases))
        return self.real(np.sum([basis @ part for basis, part in zip(self.bases, parts)], axis=0))

    def real(self, part: ndarray) -> ndarray:
        """What is of this and of the conjugate representation, if that is another."""
        return 2 * part.real if self.twice else part


def representations(rotations: int, mirror: bool) -> Iterator[ndarray]:
    """Irreducible unitary matrices of the motions in the order of `Symmetry.permutations`; of two
    that are conjugate the first."""
    for m in range(rotations // 2 + 1):
        angle = 2 * np.pi / rotations * (m * np.arange(rotations) % rotations)
        c, s = np.cos(angle), np.sin(angle)
        if m == 0 or 2 * m == rotations:
            turns = c.round()[:, None, None]
            signs = (1, -1) if mirror else ()
            yield from [np.concatenate([turns, sign * turns]) for sign in signs] or [turns]
        elif mirror:
            turns = np.array([[c, -s], [s, c]]).transpose(2, 0, 1)
            yield np.concatenate([turns, turns * [1, -1]])
        else:
            yield (c + 1j * s)[:, None, None]
