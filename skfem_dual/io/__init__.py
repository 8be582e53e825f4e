"""Files: meshes, ground, load cases and surfaces in, dual grids, solutions and structures out."""

from .cases import CaseRow, read_cases, write_cases
from .fields import write_field
from .grounds import read_substrate
from .meshes import read_mesh
from .polygons import read_dual, read_polygons, write_dual, write_polygons, write_solution
from .structures import write_structure
from .writing import require_outputs, write_whole

__all__ = [
    "CaseRow",
    "read_cases",
    "read_dual",
    "read_mesh",
    "read_polygons",
    "read_substrate",
    "require_outputs",
    "write_cases",
    "write_dual",
    "write_field",
    "write_polygons",
    "write_solution",
    "write_structure",
    "write_whole",
]
