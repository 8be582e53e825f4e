"""Reference mappings that no other thread is filling."""

from skfem import Mesh
from skfem.mapping import Mapping, MappingAffine


def own_mapping(mesh: Mesh) -> Mapping:
    """The reference mapping of a mesh that may be shared, for one caller alone.

    A mesh keeps its mapping, and scikit-fem fills the matrices of an affine one on first use
    without a lock: a thread would read what another has not filled yet.
    """
    return MappingAffine(mesh) if mesh.affine else mesh.mapping()
