"""Dual grids of triangulations and rigid punches on elastic half-spaces, beside scikit-fem."""

from .errors import ConvergenceError, ConvergenceWarning, MeshError, MeshWarning
from .grids.cellwise import CellwiseBasis
from .grids.checks import check_mesh
from .grids.dual_mesh import DualMesh

__version__ = "0.1.0"

__all__ = [
    "CellwiseBasis",
    "ConvergenceError",
    "ConvergenceWarning",
    "DualMesh",
    "MeshError",
    "MeshWarning",
    "check_mesh",
]
