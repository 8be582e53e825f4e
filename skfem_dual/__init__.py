"""Dual grids of triangulations and rigid punches on elastic half-spaces, beside scikit-fem."""

from .contact.loads import flexible_settlement
from .contact.punch import RigidPunch
from .contact.solution import EdgeCoefficient, PunchSolution
from .contact.stratified import GradedHalfSpace, Layer, LayeredHalfSpace
from .contact.substrates import HalfSpace
from .errors import ConvergenceError, ConvergenceWarning, MeshError, MeshWarning
from .grids.cellwise import CellwiseBasis
from .grids.checks import MeshReport, check_mesh
from .grids.couples import GridCouple
from .grids.dual_mesh import DualMesh
from .grids.duality import DualReport, check_dual
from .grids.extremal import maximal_couple, minimal_couple
from .grids.general import dual_nodes, general_triangulation
from .grids.preprocess import PreprocessReport, improve, relocate, repair
from .grids.rectangles import rectangular_couple
from .grids.voronoi import delaunay_voronoi

__version__ = "0.1.0"

__all__ = [
    "CellwiseBasis",
    "ConvergenceError",
    "ConvergenceWarning",
    "DualMesh",
    "DualReport",
    "EdgeCoefficient",
    "GradedHalfSpace",
    "GridCouple",
    "HalfSpace",
    "Layer",
    "LayeredHalfSpace",
    "MeshError",
    "MeshReport",
    "MeshWarning",
    "PreprocessReport",
    "PunchSolution",
    "RigidPunch",
    "check_dual",
    "check_mesh",
    "delaunay_voronoi",
    "dual_nodes",
    "flexible_settlement",
    "general_triangulation",
    "improve",
    "maximal_couple",
    "minimal_couple",
    "rectangular_couple",
    "relocate",
    "repair",
]
