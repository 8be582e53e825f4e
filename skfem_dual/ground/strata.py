"""Strata of the ground, and the amplitudes of waves of load in them.

A wave of pressure J0(k r) on the surface causes, at a depth, the displacements u J1(k r) outwards
and w J0(k r) downwards and the tractions t J1(k r) and s J0(k r), tension positive. The compliance
is known at every depth from what lies below; with it the tractions are integrated downwards, in
which direction they decay: nothing grows, whatever the wave number. Sources: those of
`compliance`.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from .compliance import (
    FORGOTTEN,
    Moduli,
    across_graded,
    across_homogeneous,
    as_pair,
    homogeneous,
    homogeneous_across,
    rigid,
    through_graded,
    through_homogeneous,
)

Pair = tuple[ndarray, ndarray]
#: depth over 1/k from which on tractions are negligible
FADED = 40.0
#: depths that differ from that of an interface by so little of it are in it
ROUNDING = 1e-12


class Stratum(NamedTuple):
    """Ground between two depths.

    Attributes
    ----------
    thickness : float
        Infinite for what goes on for ever.
    moduli : callable
        E/E0 and nu at depths below its top.
    uniform : bool
        Whether they do not vary.
    """

    thickness: float
    moduli: Moduli
    uniform: bool

    def below(self, depth: float) -> Self:
        """What remains of it below a depth."""
        if depth == 0:
            return self
        return self._replace(
            thickness=self.thickness - depth, moduli=lambda z: self.moduli(depth + z)
        )

    def up(self, pair: Pair | None, k: ndarray, down: bool) -> tuple[ndarray, ndarray]:
        """Q on top from X and Y at the bottom, and the way down.

        Parameters
        ----------
        pair : tuple of (n, 2, 2) array of float or None
            None without a bottom.
        k : (n,) array of float
        down : bool
            Whether the second array is wanted.

        Returns
        -------
        (3, n) and (n, 2, 2) array of float
            As of `through_homogeneous`.
        """
        if self.uniform:
            ratio, nu = (float(m[0]) for m in self.moduli(np.zeros(1)))
            if pair is None:
                return homogeneous(np.full(len(k), ratio), nu), np.zeros((len(k), 2, 2))
            # a thicker layer would be the same, its bottom is forgotten
            return through_homogeneous(pair, (k * self.thickness).clip(max=2 * FADED), ratio, nu)
        bottom = np.minimum(self.thickness, (FADED if down else FORGOTTEN) / k)
        start = homogeneous(*self.moduli(bottom))
        reached = bottom == self.thickness
        if pair is None:
            return through_graded(start, k, bottom, self.moduli)
        x, y = pair
        q = y @ np.linalg.inv(x)
        start = np.where(reached, np.stack([q[:, 0, 0], q[:, 0, 1], q[:, 1, 1]]), start)
        q, tractions = through_graded(start, k, bottom, self.moduli, down=down)
        # nothing of short waves reaches the bottom
        return q, np.where(reached[:, None, None], np.linalg.inv(x) @ tractions, 0.0)

    def across(self, s: ndarray | None, k: ndarray) -> ndarray:
        """S on top from S at the bottom, (n,); None without a bottom."""
        if self.uniform:
            ratio, nu = (float(m[0]) for m in self.moduli(np.zeros(1)))
            if s is None:
                return np.full(len(k), homogeneous_across(ratio, nu))
            return across_homogeneous(s, k * self.thickness, ratio, nu)
        bottom = np.minimum(self.thickness, FORGOTTEN / k)
        start = homogeneous_across(*self.moduli(bottom))
        if s is not None:
            start = np.where(bottom == self.thickness, s, start)
        return across_graded(start, k, bottom, self.moduli)


class Amplitudes(NamedTuple):
    """At depths, under waves of unit pressure; shape (ndepths, nwaves).

    Attributes
    ----------
    t, s : array of float
        Shear and normal traction, tension positive.
    u, w : array of float
        Displacements outwards and downwards, times k E0.
    """

    t: ndarray
    s: ndarray
    u: ndarray
    w: ndarray


class Strata(NamedTuple):
    """All strata of a ground.

    Attributes
    ----------
    layers : tuple of Stratum
        From the surface down.
    base : "bonded", "smooth" or None
        The rigid base; None where the last stratum goes on for ever.
    """

    layers: tuple[Stratum, ...]
    base: str | None

    @property
    def interfaces(self) -> ndarray:
        """Depths of the bottoms of all layers, the last may be infinite."""
        return np.cumsum([layer.thickness for layer in self.layers])

    def on_interfaces(self, depths: ndarray) -> ndarray:
        """Depths, those in an interface but for rounding as these are."""
        for interface in self.interfaces[np.isfinite(self.interfaces)]:
            depths = np.where(
                np.abs(depths - interface) <= ROUNDING * interface, interface, depths
            )
        return depths

    def moduli(self, depths: ndarray) -> tuple[ndarray, ndarray]:
        """E/E0 and nu at depths, in an interface those above it."""
        bottoms, depths = self.interfaces, self.on_interfaces(depths)
        number = np.searchsorted(bottoms, depths).clip(max=len(bottoms) - 1)
        out = np.empty((2, len(depths)))
        for i, layer in enumerate(self.layers):
            own = number == i
            top = bottoms[i] - layer.thickness if np.isfinite(bottoms[i]) else _last(bottoms[:-1])
            out[:, own] = layer.moduli(depths[own] - top)
        return out[0], out[1]

    def compliance(self, k: ndarray) -> ndarray:
        """Q at the surface, shape (3, n)."""
        pair = self._bottom(k)
        for layer in reversed(self.layers):
            q, _ = layer.up(pair, k, down=False)
            pair = as_pair(q)
        return q

    def compliance_across(self, k: ndarray) -> ndarray:
        """S at the surface, shape (n,), above what is not a smooth base."""
        s = None if self.base is None else np.zeros(len(k))
        for layer in reversed(self.layers):
            s = layer.across(s, k)
        return np.asarray(s)

    def _bottom(self, k: ndarray) -> Pair | None:
        return None if self.base is None else rigid(self.base == "smooth", len(k))

    def amplitudes(self, k: ndarray, depths: ndarray) -> Amplitudes:
        """Of waves at depths that ascend, none of them below a rigid base."""
        cut = self._cut(depths)
        pair = self._bottom(k)
        ways = []
        for top, layer, _ in reversed(cut):
            # of waves that have faded nothing comes up again
            live = k * top < FADED
            q = homogeneous(*(np.full(len(k), m[0]) for m in layer.moduli(np.zeros(1))))
            down = np.zeros((len(k), 2, 2))
            if live.any():
                below = None if pair is None else (pair[0][live], pair[1][live])
                q[:, live], down[live] = layer.up(below, k[live], down=True)
            ways.append((pair, down))
            pair = as_pair(q)
        out: list[ndarray] = []
        tractions = np.tile([[0.0], [-1.0]], (len(k), 1, 1))
        for (bottom, down), (_, _, wanted) in zip(reversed(ways), cut, strict=True):
            if bottom is None or len(out) == len(depths):
                break
            multiples = down @ tractions
            x, y = bottom
            tractions = x @ multiples
            if wanted:
                out.append(np.concatenate([tractions, -y @ multiples], axis=1)[..., 0].T)
        return Amplitudes(*np.stack(out, axis=1))

    def _cut(self, depths: ndarray) -> list[tuple[float, Stratum, bool]]:
        """Layers cut at depths: their tops, they themselves, whether they end at a depth."""
        parts = []
        begin = 0.0
        for layer, end in zip(self.layers, self.interfaces, strict=True):
            inside = depths[(depths > begin) & (depths < end)]
            tops = [begin, *(float(z) for z in inside)]
            for top, bottom in zip(tops, [*tops[1:], end], strict=True):
                part = layer.below(top - begin)._replace(thickness=bottom - top)
                parts.append((top, part, bool((depths == bottom).any())))
            begin = float(end)
        return parts


def _last(bottoms: Sequence[float] | ndarray) -> float:
    return float(bottoms[-1]) if len(bottoms) else 0.0
