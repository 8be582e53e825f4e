"""Cells of mesh files as what the package takes: straight triangles, quadrilaterals and lines."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..errors import MeshError
from ..grids.planar import cross
from ..grids.polygons import some
from .writing import PathLike

#: cells that are read: what their corners make, and numbers of nodes, corners first
KINDS = {
    "triangle": ("triangle", 3),
    "triangle6": ("triangle", 6),
    "triangle7": ("triangle", 7),
    "quad": ("quad", 4),
    "quad8": ("quad", 8),
    "quad9": ("quad", 9),
    "line": ("line", 2),
    "line3": ("line", 3),
}
CORNERS = {"triangle": 3, "quad": 4, "line": 2}
#: a side shorter than this part of the longest has no length
SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of one block of a file.

    Attributes
    ----------
    kind : str
        ``"triangle"``, ``"quad"`` or ``"line"``.
    nodes : (n, 3), (n, 4) or (n, 2) array of int
        Their corners.
    source : (n,) array of int
        The cells in the file that they were made of.
    left_out : array of int
        Nodes on sides and inside and such at the same place, which they do not keep.
    """

    kind: str
    nodes: ndarray
    source: ndarray
    left_out: ndarray

    def members(self, index: Any, n: int, name: str, path: PathLike) -> ndarray:
        """Cells made of some of the n in the file, those of a set; of equal lines one.

        Raises
        ------
        MeshError
            If the file has no such cells.
        """
        index = np.asarray([] if index is None else index)
        if index.size == 0:
            return np.zeros(0, dtype=np.int64)
        if index.ndim != 1 or index.dtype.kind not in "iu" or index.min() < 0 or index.max() >= n:
            raise MeshError(
                f"expected cells from 0 to {n - 1} in the set {name!r} of {path}, got "
                f"{some(index.ravel())}"
            )
        found = np.nonzero(np.isin(self.source, index))[0]
        if self.kind == "line":
            ends = np.sort(self.nodes[found], axis=1)
            found = found[np.sort(np.unique(ends, axis=0, return_index=True)[1])]
        return found

    def data(self, values: Any) -> Any:
        """Values of the cells in the file, for those made of them."""
        return np.asarray(values)[self.source]

    def cut(self, points: ndarray, same: ndarray) -> "Cells":
        """Triangles, or lines, between the nodes that stand for theirs, with sides of a length."""
        nodes, source, kind = same[self.nodes], self.source, self.kind
        if kind == "quad":
            nodes, source, kind = _halves(points, nodes), np.repeat(source, 2), "triangle"
        flat = (nodes == np.roll(nodes, 1, axis=1)).any(axis=1)
        if self.kind == "triangle":  # which is refused with the others without area
            flat[:] = False
        gone = self.nodes[same[self.nodes] != self.nodes]
        return Cells(kind, nodes[~flat], source[~flat], np.append(self.left_out, gone))


def wanted_faces(counts: dict[str, int], quads: str, path: PathLike) -> str:
    """What the cells will be, ``"triangle"`` or ``"quad"``.

    Raises
    ------
    MeshError
        If there are neither, or both where quadrilaterals are kept.
    """
    faces = {KINDS[k][0] for k, n in counts.items() if n and k in KINDS} - {"line"}
    if not faces:
        had = ", ".join(f"{n} {kind}" for kind, n in counts.items()) or "no cells"
        raise MeshError(
            f"expected triangles or quadrilaterals in {path}, got {had}. Remedy: mesh the plan "
            "with triangles"
        )
    if quads == "keep" and len(faces) == 2:
        raise MeshError(
            f'expected quadrilaterals only in {path}, got triangles as well. Remedy: quads="split"'
        )
    return "quad" if quads == "keep" and "quad" in faces else "triangle"


def changes(counts: dict[str, int], wanted: str, few: int) -> str:
    """What becomes of the cells in a file that are not what is made of them; empty if all are.

    Of so few quadrilaterals less than two triangles are made.
    """
    told = []
    if curved := {
        k: n for k, n in counts.items() if k in KINDS and KINDS[k][1] > CORNERS[KINDS[k][0]]
    }:
        had = ", ".join(f"{n} {kind}" for kind, n in curved.items())
        told.append(f"of {had} the corners are kept, their sides are straight")
    split = sum(n for k, n in counts.items() if KINDS.get(k, ("",))[0] == "quad")
    if split and wanted == "triangle":
        but = f", but {few} with sides of no length into one or none" if few else ""
        told.append(f"{split} quadrilaterals are cut into two triangles each{but}")
    return "; ".join(told)


def plain_cells(block: Any, n: int, path: PathLike) -> Cells:
    """The cells of a block by their corners, which are some of n points.

    Raises
    ------
    MeshError
        If its nodes are not points of the file.
    """
    nodes = np.asarray(block.data)
    kind, size = KINDS[block.type]
    if nodes.ndim != 2 or nodes.shape[1] != size or nodes.dtype.kind not in "iu":
        raise MeshError(
            f"expected {size} whole numbers for each {block.type} in {path}, got an array of "
            f"{nodes.dtype} of shape {nodes.shape}"
        )
    if nodes.size and (nodes.min() < 0 or nodes.max() >= n):
        wrong = np.nonzero(((nodes < 0) | (nodes >= n)).any(axis=1))[0]
        raise MeshError(
            f"expected nodes from 0 to {n - 1} in {path}, got {nodes[wrong[0]].tolist()} in "
            f"{block.type} {wrong[0]}, the first of {wrong.size}; numbers count from 0. Remedy: "
            "write the file again from the program that made the mesh"
        )
    nodes, left_out = np.split(nodes.astype(np.int64), [CORNERS[kind]], axis=1)
    return Cells(kind, nodes, np.arange(len(nodes)), np.unique(left_out))


def triangles(cells: list[Cells], points: ndarray) -> list[Cells]:
    """The cells with quadrilaterals cut into two triangles, or one if a side has no length.

    Nodes at the ends of such a side become one, as in the middle of polar grids.
    """
    quads = np.vstack([part.nodes for part in cells if part.kind == "quad"])
    ends = np.stack([quads, np.roll(quads, -1, axis=1)])
    with np.errstate(over="ignore", invalid="ignore"):  # coordinates are looked at later
        length = np.hypot(*(points[ends[1], :2] - points[ends[0], :2]).transpose(2, 0, 1))
        longest = length.max(axis=1, keepdims=True)
        short = ends[:, (length <= SAME * longest) & np.isfinite(longest)]
    n = len(points)
    label = connected_components(coo_array((np.ones(len(short.T)), short), (n, n)))[1]
    _, first = np.unique(label, return_index=True)
    return [part.cut(points, first[label]) for part in cells]


def _halves(points: ndarray, quads: ndarray) -> ndarray:
    """Two triangles of each quadrilateral, one after the other; shape (2 n, 3).

    They are cut along the diagonal whose smaller triangle is larger; with equal ones, as in
    parallelograms, along the shorter.
    """
    cuts = np.array([[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]])
    x = points[:, :2].T[:, quads]  # (2, n, 4)
    a, b, c = (x[:, :, cuts[..., k]] for k in range(3))
    area = cross(b - a, c - a)  # (n, 2 cuts, 2 halves)
    least = (area * np.sign(area.sum(axis=2, keepdims=True))).min(axis=2)
    diagonal = np.stack(
        [np.hypot(*(x[:, :, 2] - x[:, :, 0])), np.hypot(*(x[:, :, 3] - x[:, :, 1]))]
    )
    equal = np.abs(least[:, 0] - least[:, 1]) <= 1e-9 * np.abs(least).max(axis=1)
    second = np.where(equal, diagonal[1] < diagonal[0] * (1 - 1e-9), least[:, 1] > least[:, 0])
    return quads[np.arange(len(quads))[:, None, None], cuts[second.astype(int)]].reshape(-1, 3)
