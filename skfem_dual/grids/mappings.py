"""Reference mappings that no other thread is filling, and that keep digits far from the origin."""

from copy import copy

import numpy as np
from numpy import ndarray
from skfem import CellBasis, Mesh, MeshQuad1DG, MeshQuad2, MeshTri1DG, MeshTri2
from skfem.mapping import Mapping, MappingAffine, MappingIsoparametric

#: steps of Newton's method, and the last of them that will do at all and at once
STEPS, LARGEST, LEAST = 20, 1e-10, 1e-13


def own_mapping(mesh: Mesh) -> Mapping:
    """The reference mapping of a mesh that may be shared, for one caller alone.

    A mesh keeps its mapping, and scikit-fem fills the matrices of an affine one on first use
    without a lock: a thread would read what another has not filled yet.
    """
    return MappingAffine(mesh) if mesh.affine else mesh.mapping()


def with_own_mesh(basis: CellBasis) -> CellBasis:
    """The basis with a mesh of its own, whose coordinates and elements nobody changes in place."""
    mesh = basis.mesh
    if not (mesh.doflocs.flags.writeable or mesh.t.flags.writeable):
        return basis
    basis, own = copy(basis), copy(mesh)
    own.__dict__.pop("_cached_mapping", None)
    for name in ("doflocs", "t"):
        array = getattr(mesh, name).copy(order="K")
        array.flags.writeable = False
        object.__setattr__(own, name, array)
    basis.mesh = own
    if type(basis.mapping) in (MappingAffine, MappingIsoparametric) and basis.mapping.mesh is mesh:
        basis.mapping = own_mapping(own)
    return basis


def places_of(mesh: Mesh) -> tuple[ndarray, ndarray]:
    """Vertices of a plane mesh, and their numbers in each element.

    On discontinuous and periodic meshes those in ``t`` are none of places: there each element has
    vertices of its own.
    """
    if isinstance(mesh, (MeshTri1DG, MeshQuad1DG)):
        return mesh.doflocs, mesh.dofs.element_dofs
    return mesh.p, mesh.t


def bends(mesh: Mesh) -> ndarray:
    """How far the sides of elements of second order bend, shape (nfacets,); others do not."""
    if not isinstance(mesh, (MeshTri2, MeshQuad2)):
        return np.zeros(mesh.nfacets)
    first, last = mesh.p[:, mesh.facets[0]], mesh.p[:, mesh.facets[1]]
    off = mesh.doflocs[:, mesh.dofs.facet_dofs[0]] - (first + last) / 2
    side = last - first
    length = np.hypot(*side)
    across = np.abs(side[0] * off[1] - side[1] * off[0]) / np.where(length > 0, length, 1.0)
    return np.where(length > 0, across, np.hypot(*off))


def middle_of(mesh: Mesh) -> ndarray:
    """Middle of its extent."""
    return (mesh.p.min(axis=1) + mesh.p.max(axis=1)) / 2


def mapping_about_middle(mesh: Mesh) -> Mapping:
    """That of the mesh moved to the origin, where polynomials of coordinates have all digits."""
    return own_mapping(mesh.translated(-middle_of(mesh)))


def is_far(mesh: Mesh, sizes: float = 1.0) -> bool:
    """Whether a mesh lies farther from the origin than so many of its sizes along some axis."""
    return bool((np.abs(middle_of(mesh)) > sizes * np.ptp(mesh.p, axis=1)).any())


class InverseAboutMiddle(MappingIsoparametric):
    """The isoparametric mapping of a mesh, inverted in coordinates about its middle.

    Farther from the origin than some hundred of its sizes that of scikit-fem does not converge.
    """

    def __init__(self, mesh: Mesh):
        super().__init__(mesh, mesh.elem(), mesh.bndelem)
        self._middle, self._moved = middle_of(mesh), mapping_about_middle(mesh)

    def invF(self, x: ndarray, tind: ndarray | None = None, *_: object) -> ndarray:
        """Coordinates in the reference element of points of shape (dim, m, q) in elements."""
        tind = np.arange(self.mesh.nelements) if tind is None else tind
        return inverse(self._moved, x - self._middle[:, None, None], tind)


def inverting(mapping: Mapping) -> Mapping:
    """A mapping whose inverse has all digits, wherever its mesh lies: most often itself."""
    mesh = mapping.mesh
    usual = type(mapping) is MappingIsoparametric and type(mapping.elem) is mesh.elem
    return InverseAboutMiddle(mesh) if usual and is_far(mesh) else mapping


def inverse(mapping: Mapping, x: ndarray, element: ndarray) -> ndarray:
    """Coordinates in the reference element of points of shape (dim, m, q) in elements.

    By Newton's method where the mapping is not affine; scikit-fem's own stays inside the
    reference element and would not find points beside it by rounding.

    Raises
    ------
    ValueError
        If that of an element cannot be inverted.
    """
    if isinstance(mapping, (MappingAffine, InverseAboutMiddle)):
        return mapping.invF(x, tind=element)
    found = np.full(x.shape, 1 / 3)
    for _ in range(STEPS):
        step = np.einsum(
            "ijkl,jkl->ikl", mapping.invDF(found, element), x - mapping.F(found, element)
        )
        found = found + step
        if np.abs(step).max(initial=0.0) < LEAST:
            return found
    if np.abs(step).max() < LARGEST:
        return found
    bad = element[np.argmax(np.abs(step).max(axis=(0, 2)))]
    raise ValueError(
        f"expected elements whose mapping can be inverted, element {bad} cannot. Remedy: "
        "convex elements, not degenerate"
    )
