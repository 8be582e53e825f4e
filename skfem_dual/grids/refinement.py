"""Triangles cut into smaller ones that become narrow towards an edge."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from .polygons import readonly


@dataclass(frozen=True, eq=False)
class Refinement:
    """A triangulation in each triangle of another.

    Attributes
    ----------
    base, mesh : MeshTri
        The triangulation and its refinement of N nodes.
    parent : (N,) array of int
        A triangle of the base that has each node.
    shares : (3, N) array of float
        Barycentric coordinates of the node there.
    edge : (N,) array of bool
        Whether the node is on the edge.
    """

    base: MeshTri
    mesh: MeshTri
    parent: ndarray
    shares: ndarray
    edge: ndarray

    @classmethod
    def towards(cls, base: MeshTri, edge: ndarray, times: int) -> "Refinement":
        """With the sides of the triangles cut in two some times.

        In triangles that touch the edge the nodes are drawn to it, from equal parts to widths
        that grow like ``exp(times way)`` on the way from the edge: a first-order field follows
        the inverse square root of the distance where equal parts leave it but one element.
        Triangles with a side across the plan, from edge to edge, are cut around their middles
        before.

        Parameters
        ----------
        base : MeshTri
            The triangulation.
        edge : (nfacets,) array of bool
            Its facets on the edge; there may be none.
        times : int
            How often.
        """
        at_edge = np.zeros(base.p.shape[1], dtype=bool)
        at_edge[base.facets[:, edge]] = True
        t, parent, corners = _without_chords(
            base, at_edge, at_edge[base.facets].all(axis=0) & ~edge
        )
        n = max(len(at_edge), t.max() + 1)
        at_edge = np.pad(at_edge, (0, n - len(at_edge)))
        lattice, small = _lattice(2**times)
        number = _numbers(t, n, lattice)
        own, shares = np.zeros(number.max() + 1, dtype=np.int64), np.ones((3, number.max() + 1))
        own[number] = np.arange(t.shape[1])
        shares[:, number] = (lattice / 2**times)[..., None]
        way = np.sum(shares * ~at_edge[t[:, own]], axis=0)
        steep = max(times, 1)
        drawn = np.expm1(steep * way) / np.expm1(steep)
        with np.errstate(invalid="ignore", divide="ignore"):
            inner, outer = drawn / way, (1 - drawn) / (1 - way)
        shares = shares * np.where(at_edge[t[:, own]], outer, inner)
        shares = np.where(np.isfinite(shares), shares, 0.0)
        shares = np.einsum("ijk,jk->ik", corners[..., own], shares)
        p = np.einsum("dik,ik->dk", base.p[:, base.t[:, parent[own]]], shares)
        p[:, : base.p.shape[1]] = base.p
        mesh = MeshTri(np.ascontiguousarray(p), number[small].reshape(3, -1))
        return cls(base, mesh, readonly(parent[own]), readonly(shares), readonly(way == 0))


def _without_chords(
    base: MeshTri, at_edge: ndarray, chords: ndarray
) -> tuple[ndarray, ndarray, ndarray]:
    """Triangles with a chord, or with no vertex inside, cut around their middles, chords in two.

    Returns the triangles with ascending vertices, (3, m), new ones after those of the base; the
    triangle of the base each is in; and the barycentric coordinates there, first axis, of the
    vertices, second axis.
    """
    n, t = base.p.shape[1], base.t
    cut = chords[base.t2f].any(axis=0) | at_edge[t].all(axis=0)
    own = np.nonzero(cut)[0]
    half = np.full(base.nfacets, -1)
    half[chords] = n + np.arange(np.count_nonzero(chords))
    middle = n + np.count_nonzero(chords) + np.arange(len(own))
    whole, unit = np.nonzero(~cut)[0], np.eye(3)
    parts = [(t[:, whole], whole, np.repeat(unit[..., None], len(whole), axis=2))]
    for side, (i, j) in enumerate(((0, 1), (1, 2), (0, 2))):
        between = half[base.t2f[side, own]]
        two, k = between >= 0, (unit[i] + unit[j]) / 2
        for ends, some, points in (
            ((t[i, own], t[j, own]), ~two, (unit[i], unit[j])),
            ((t[i, own], between), two, (unit[i], k)),
            ((t[j, own], between), two, (unit[j], k)),
        ):
            corners = np.stack([*points, np.full(3, 1 / 3)], axis=1)
            corners = np.repeat(corners[..., None], np.count_nonzero(some), axis=2)
            parts.append((np.stack([*ends, middle])[:, some], own[some], corners))
    t, parent, corners = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
    order = np.argsort(t, axis=0)
    return (
        np.take_along_axis(t, order, axis=0),
        parent,
        np.take_along_axis(corners, order[None], axis=1),
    )


def _lattice(n: int) -> tuple[ndarray, ndarray]:
    """Points of a triangle with sides in n parts, three counts each that add up to n, shape
    (3, k), and the triangles between them, shape (3, n^2)."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
    inside = i + j <= n
    number = np.full((n + 2, n + 2), -1)
    i, j = i[inside], j[inside]
    number[i, j] = np.arange(len(i))
    up = np.stack([number[i, j], number[i + 1, j], number[i, j + 1]])[:, i + j < n]
    down = np.stack([number[i + 1, j + 1], number[i + 1, j], number[i, j + 1]])[:, i + j < n - 1]
    return np.stack([n - i - j, i, j]), np.hstack([up, down])


def _numbers(t: ndarray, first: int, lattice: ndarray) -> ndarray:
    """Number of each point of the lattice in each triangle with ascending vertices: vertices,
    from ``first`` on points of sides, then points inside; shape (k, m)."""
    n, m = lattice.sum(axis=0)[0], t.shape[1]
    ends = np.hstack([t[[0, 1]], t[[1, 2]], t[[0, 2]]])
    sides, which = np.unique(ends[0] * np.int64(first) + ends[1], return_inverse=True)
    out = np.empty((lattice.shape[1], m), dtype=np.int64)
    for vertex in range(3):
        out[lattice[vertex] == n] = t[vertex]
    for side, (i, j) in enumerate(((0, 1), (1, 2), (0, 2))):
        on = (lattice[i] > 0) & (lattice[j] > 0) & (lattice[i] + lattice[j] == n)
        own = which.reshape(3, m)[side]
        out[on] = first + own * (n - 1) + (lattice[j, on] - 1)[:, None]
    inner = (lattice > 0).all(axis=0)
    k = np.count_nonzero(inner)
    out[inner] = first + len(sides) * (n - 1) + np.arange(m) * k + np.arange(k)[:, None]
    return out
