"""Dual grids of triangulations and rigid punches on elastic half-spaces, beside scikit-fem."""

from .contact.punch import RigidPunch
from .contact.solution import EdgeCoefficient, PunchSolution
from .contact.substrates import HalfSpace
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
    "EdgeCoefficient",
    "HalfSpace",
    "MeshError",
    "MeshWarning",
    "PunchSolution",
    "RigidPunch",
    "check_mesh",
]
