"""Dual grids of triangulations, and what presses on elastic ground, beside scikit-fem."""

from . import startup as startup  # first, it looks after the other imports
from .bodies.elastic import ElasticPunch
from .bodies.group import RigidPunches
from .bodies.paths import LoadPath, MomentRotation, load_path, moment_rotation
from .bodies.plates import Plate, column_load
from .bodies.punch import RigidPunch
from .bodies.punches import Punches
from .bodies.refine import refine_to_contact
from .contact.load import Load
from .contact.measured import MeasuredProfile
from .contact.motions import ShearSolution
from .contact.region import ContactRegion
from .contact.shapes import Cone, Paraboloid, RoundedCylinder, Sphere
from .elements.flexible import flexible_settlement
from .elements.load_matrix import load_matrix
from .elements.stresses import Stresses
from .elements.transfer import evaluate, transfer
from .errors import (
    ConvergenceError,
    ConvergenceWarning,
    MeshError,
    MeshWarning,
    ResolutionWarning,
)
from .grids.cellwise import CellwiseBasis
from .grids.checks import MeshReport, check_mesh
from .grids.couples import GridCouple
from .grids.dual_mesh import DualMesh
from .grids.duality import DualReport, check_dual
from .grids.extremal import maximal_couple, minimal_couple
from .grids.general import dual_nodes, general_triangulation
from .grids.preprocess import PreprocessReport, improve, relocate, repair
from .grids.rectangles import rectangular_couple
from .grids.trace import trace
from .grids.voronoi import delaunay_voronoi
from .ground.graded import GradedHalfSpace
from .ground.layered import Layer, LayeredHalfSpace
from .ground.periodic import PeriodicGround
from .ground.substrates import HalfSpace
from .operators.influence_operator import InfluenceOperator
from .operators.symmetry import Symmetry
from .plans.plan import Plan
from .plans.search import Accuracy
from .plans.solve import PlanSolution, solve_plan
from .post.estimate import CoupleEstimate, estimate_error, marked
from .post.fields import pressure_field
from .post.functional import Weights
from .post.postprocess import PostprocessedPressure, postprocess
from .post.smooth import SmoothedCouple, smooth_couple
from .solutions.bearing import bearing_pressure
from .solutions.below import (
    Profile,
    displacement_below,
    settlement_by_layers,
    stress_below,
    vertical_profile,
    vertical_section,
)
from .solutions.bounds import Bounds
from .solutions.cases_solution import CasesSolution, Extreme
from .solutions.edge_coefficient import EdgeCoefficient
from .solutions.elastic_solution import ElasticSolution
from .solutions.group_solution import PunchesSolution
from .solutions.punch_solution import PunchSolution
from .sweeps.outcomes import Outcome, SweepResult
from .sweeps.run import sweep

__version__ = "0.1.0"

__all__ = [
    "Accuracy",
    "Bounds",
    "CasesSolution",
    "CellwiseBasis",
    "Cone",
    "ContactRegion",
    "ConvergenceError",
    "ConvergenceWarning",
    "CoupleEstimate",
    "DualMesh",
    "DualReport",
    "EdgeCoefficient",
    "ElasticPunch",
    "ElasticSolution",
    "Extreme",
    "GradedHalfSpace",
    "GridCouple",
    "HalfSpace",
    "InfluenceOperator",
    "Layer",
    "LayeredHalfSpace",
    "Load",
    "LoadPath",
    "MeasuredProfile",
    "MeshError",
    "MeshReport",
    "MeshWarning",
    "MomentRotation",
    "Outcome",
    "Paraboloid",
    "PeriodicGround",
    "Plan",
    "PlanSolution",
    "Plate",
    "PostprocessedPressure",
    "PreprocessReport",
    "Profile",
    "PunchSolution",
    "Punches",
    "PunchesSolution",
    "ResolutionWarning",
    "RigidPunch",
    "RigidPunches",
    "RoundedCylinder",
    "ShearSolution",
    "SmoothedCouple",
    "Sphere",
    "Stresses",
    "SweepResult",
    "Symmetry",
    "Weights",
    "bearing_pressure",
    "check_dual",
    "check_mesh",
    "column_load",
    "delaunay_voronoi",
    "displacement_below",
    "dual_nodes",
    "estimate_error",
    "evaluate",
    "flexible_settlement",
    "general_triangulation",
    "improve",
    "load_matrix",
    "load_path",
    "marked",
    "maximal_couple",
    "minimal_couple",
    "moment_rotation",
    "postprocess",
    "pressure_field",
    "rectangular_couple",
    "refine_to_contact",
    "relocate",
    "repair",
    "settlement_by_layers",
    "smooth_couple",
    "solve_plan",
    "stress_below",
    "sweep",
    "trace",
    "transfer",
    "vertical_profile",
    "vertical_section",
]
