"""Reference mappings that no other thread is filling."""

from numpy import ndarray
from skfem import Mesh
from skfem.mapping import Mapping, MappingAffine


def own_mapping(mesh: Mesh) -> Mapping:
    """The reference mapping of a mesh that may be shared, for one caller alone.

    A mesh keeps its mapping, and scikit-fem fills the matrices of an affine one on first use
    without a lock: a thread would read what another has not filled yet.
    """
    return MappingAffine(mesh) if mesh.affine else mesh.mapping()


def middle_of(mesh: Mesh) -> ndarray:
    """Middle of its extent."""
    return (mesh.p.min(axis=1) + mesh.p.max(axis=1)) / 2


def mapping_about_middle(mesh: Mesh) -> Mapping:
    """That of the mesh moved to the origin, where polynomials of coordinates have all digits."""
    return own_mapping(mesh.translated(-middle_of(mesh)))
