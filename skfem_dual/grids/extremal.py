"""The minimal and the maximal dual grid of a triangulation (Definition 4)."""

import numpy as np
from skfem import MeshTri

from ..errors import MeshError
from .corners import signed_areas
from .couples import GridCouple, grid_of
from .dual_mesh import DualMesh
from .planar import covered_twice, cross
from .polygons import some

#: height of triangles over their length below which rounding decides where nodes are
FLAT = 1e-7


def minimal_couple(mesh: MeshTri | DualMesh) -> GridCouple:
    """A triangulation A and its minimal dual grid: a cell for every inner node (Definition 4).

    The cells of B are those of the 1-type dual grid at the inner nodes.

    Parameters
    ----------
    mesh : MeshTri or DualMesh
        The triangulation, whose 1-type dual grid must be valid.

    Raises
    ------
    TypeError, MeshError
        As `DualMesh.from_mesh`; and MeshError if a triangle has no inner node, because then
        there is no minimal dual grid (Definition 3, condition 2).
    """
    dual = mesh if isinstance(mesh, DualMesh) else DualMesh.from_mesh(mesh)
    mesh, m = dual.mesh, dual.mesh.nelements
    number = np.full(len(dual), -1)
    inner = mesh.interior_nodes()
    number[inner] = np.arange(len(inner))
    bare = np.nonzero((number[mesh.t] < 0).all(axis=0))[0]
    if len(inner) == 0 or len(bare):
        raise MeshError(
            "expected an inner node in every triangle, without which there is no minimal dual "
            f"grid; triangles {some(bare)} have none. Remedy: flip facets there, as "
            "refined corners have such triangles again; maximal_couple may exist"
        )
    ribs = np.nonzero((number[mesh.facets] >= 0).any(axis=0))[0]
    held = np.repeat(number >= 0, dual.polygons.sizes)
    sizes = dual.polygons.sizes[inner]
    b = grid_of(
        dual.p[:, :m],
        dual.polygons.indices[held],
        np.append(0, np.cumsum(sizes)),
        dual.facets[:, ribs],
        number[dual.f2c[:, ribs]],
        mesh.p[:, inner],
    )
    pairs = np.stack([ribs, np.arange(len(ribs))])
    return GridCouple("minimal", dual.primal_partition, b, np.arange(m), inner, pairs)


def _require_height(mesh: MeshTri) -> None:
    longest = np.max(np.ptp(mesh.p[:, mesh.t], axis=1), axis=0)
    height = np.abs(signed_areas(mesh.p, mesh.t)) / longest
    if len(bad := np.nonzero(height < FLAT * longest)[0]):
        raise MeshError(
            f"expected triangles at least {FLAT:g} of their length high for cells beyond the "
            f"edge, got flatter ones: {some(bad)}. Remedy: scale the coordinates apart"
        )


def maximal_couple(mesh: MeshTri | DualMesh) -> GridCouple:
    """A triangulation A and a maximal dual grid: all nodes inside their cells (Definition 4).

    The ribs that end in the middles of boundary facets are continued beyond the edge by their
    own length, or less where there is no room in notches, holes and gaps. The boundary nodes
    of the 1-type dual grid move out with them.

    Parameters
    ----------
    mesh : MeshTri or DualMesh
        The triangulation, whose 1-type dual grid must be valid.

    Raises
    ------
    TypeError, MeshError
        As `DualMesh.from_mesh`; and MeshError if boundary facets touch others, as in a slit, or
        triangles are so flat that by rounding nodes leave the cells beyond the edge.
    """
    dual = mesh if isinstance(mesh, DualMesh) else DualMesh.from_mesh(mesh)
    _require_height(dual.mesh)
    mesh, m, nb = dual.mesh, dual.mesh.nelements, dual.nboundary
    # after the barycentres the nodes are the middles of boundary facets, then boundary nodes
    middle, corner = dual.p[:, m : m + nb], dual.p[:, m + nb :]
    halves = slice(mesh.nfacets, None)
    start, end = dual.facets[:, halves] - m
    away = start >= nb
    onward, back = np.empty((2, nb), dtype=int)
    onward[start[away] - nb] = end[away]
    back[end[~away] - nb] = start[~away]
    # half the angle outside between the facets, from the one onward clockwise to the one back
    along = [(middle[:, k] - corner).T.copy().view(complex)[:, 0] for k in (onward, back)]
    half = np.angle(along[0] / along[1]) % (2 * np.pi) / 2
    bisector = along[0] / np.abs(along[0]) * np.exp(-1j * half)
    facet = mesh.boundary_facets()
    rib = middle - dual.p[:, mesh.f2t[0, facet]]
    inside = mesh.p[:, dual.f2c[0, halves]]
    length = np.ones(nb)
    for _ in range(20):
        reach = length * np.hypot(*rib)
        far = np.minimum(reach[onward], reach[back]) / np.maximum(np.sin(half), 0.5)
        p = np.hstack(
            [
                dual.p[:, :m],
                middle + length * rib,
                corner + far * np.stack([bisector.real, bisector.imag]),
            ]
        )
        tail, head = p[:, dual.facets[:, halves]].swapaxes(0, 1)
        bad = cross(tail - inside, head - inside) <= 0
        bad[covered_twice(p, dual.facets[:, halves], inside)] = True
        if not bad.any():
            break
        length[np.unique(np.where(away, end, start)[bad])] /= 2
    else:
        touching = np.unique(dual.partition.boundary[halves][bad])
        raise MeshError(
            f"expected room beyond the boundary for a maximal dual grid; facets {some(touching)} "
            "have none, they touch others. Remedy: join the nodes of a slit; of parts that touch "
            "in a node a couple each"
        )
    b = grid_of(p, dual.polygons.indices, dual.polygons.offsets, dual.facets, dual.f2c, mesh.p)
    return GridCouple(
        "maximal",
        dual.primal_partition,
        b,
        np.arange(m),
        np.arange(len(dual)),
        np.tile(np.arange(mesh.nfacets), (2, 1)),
    )
