"""Imports run downhill, and heavy optional packages are not imported without need."""

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import skfem_dual

ROOT = Path(skfem_dual.__file__).parent
# a module imports modules of lower layers, or of its own layer in the order below
LAYERS = [
    ["startup"],
    ["errors", "messages", "numeric", "arguments", "units"],
    [
        "kernels.disk",
        "kernels.memory",
        "kernels.compiled",
        "kernels.threads",
        "kernels.limits",
        "kernels.once",
        "kernels.progress",
    ],
    [
        "grids.polygons",
        "grids.planar",
        "grids.corners",
        "grids.report",
        "grids.quality",
        "grids.checks",
        "grids.lattice",
        "grids.mappings",
        "grids.partition",
        "grids.dual_mesh",
        "grids.cellwise",
        "grids.nearby",
        "grids.fan",
        "grids.outline",
        "grids.evening",
        "grids.nearest",
        "grids.lines",
        "grids.refinement",
        "grids.general",
        "grids.flips",
        "grids.relocation",
        "grids.preprocess",
        "grids.curves",
        "grids.short_facets",
        "grids.sizing",
        "grids.surroundings",
        "grids.generate",
        "grids.couples",
        "grids.rectangles",
        "grids.extremal",
        "grids.voronoi",
        "grids.duality",
        "grids.trace",
    ],
    [
        "plans.sides",
        "plans.rings",
        "plans.crossings",
        "plans.corners",
        "plans.parts",
        "plans.mesh",
        "plans.plan",
    ],
    [
        "ground.compliance",
        "ground.strata",
        "ground.substrates",
        "ground.symbols",
        "ground.hankel",
        "ground.shear",
        "ground.stratified",
        "ground.rigid_disc",
        "ground.seen",
        "ground.graded",
        "ground.layered",
        "ground.periodic",
        "ground.depths",
    ],
    [
        "elements.graded_rule",
        "elements.polygon_moments",
        "elements.law_moments",
        "elements.law_polynomials",
        "elements.ribs",
        "elements.segments",
        "elements.polygon_sums",
        "elements.law_strips",
        "elements.wedge_law",
        "elements.edge_weights",
        "elements.line_weights",
        "elements.pieces",
        "elements.moments",
        "elements.clouds",
        "elements.radial_series",
        "elements.remainder",
        "elements.resolution",
        "elements.influence",
        "elements.near_sums",
        "elements.edge_correction",
        "elements.near",
        "elements.balance",
        "elements.overlaps",
        "elements.shape_functions",
        "elements.load_matrix",
        "elements.slopes",
        "elements.moment_sums",
        "elements.curvature",
        "elements.near_slopes",
        "elements.cell_dipoles",
        "elements.slope_correction",
        "elements.crossed_loads",
        "elements.crossed",
        "elements.point_values",
        "elements.transfer",
        "elements.flexible",
        "elements.boussinesq",
        "elements.strips",
        "elements.clusters",
        "elements.halving",
        "elements.deep_remainder",
        "elements.tangential_remainder",
        "elements.tangential",
        "elements.depth",
        "elements.stresses",
    ],
    [
        "operators.dense",
        "operators.fmm.quadtree",
        "operators.fmm.chebyshev",
        "operators.fmm.lists",
        "operators.fmm.loops",
        "operators.fmm.linear_maps",
        "operators.fmm.families",
        "operators.fmm.assembly",
        "operators.fmm.near_entries",
        "operators.fmm.expansions",
        "operators.fmm.dipoles",
        "operators.fmm.summation",
        "operators.entries",
        "operators.toeplitz",
        "operators.resources",
        "operators.attempts",
        "operators.discretisation",
        "operators.influence_operator",
        "operators.factors",
        "operators.known_entries",
        "operators.preconditioner",
        "operators.flattened",
        "operators.iterative",
        "operators.dense_solver",
        "operators.guided",
        "operators.semidefinite",
        "operators.compliance",
        "operators.small_compliance",
        "operators.yielding",
        "operators.representations",
        "operators.symmetry",
        "operators.symmetric_matrix",
    ],
    [
        "contact.exact",
        "contact.hull",
        "contact.load",
        "contact.shapes",
        "contact.measured",
        "contact.problem",
        "contact.cell_forces",
        "contact.unilateral",
        "contact.positions",
        "contact.system",
        "contact.methods",
        "contact.planes",
        "contact.contact_line",
        "contact.region",
        "contact.plan_triangles",
        "contact.period",
        "contact.edges",
        "contact.loaded_cells",
        "contact.footprint",
        "contact.many",
        "contact.one_sign",
        "contact.verify",
        "contact.union",
        "contact.parts",
        "contact.pressed",
        "contact.line_law",
        "contact.sectors",
        "contact.line_work",
        "contact.along_lines",
        "contact.compliances",
        "contact.work",
        "contact.by_work",
        "contact.motions",
    ],
    [
        "solutions.edge_coefficient",
        "solutions.inside_cells",
        "solutions.resultant",
        "solutions.pressures",
        "solutions.bearing",
        "solutions.bounds",
        "solutions.punch_solution",
        "solutions.cases_solution",
        "solutions.elastic_solution",
        "solutions.displaced",
        "solutions.below",
        "solutions.group_solution",
    ],
    [
        "bodies.kern",
        "bodies.body",
        "bodies.frame",
        "bodies.rigid",
        "bodies.cases",
        "bodies.punch",
        "bodies.joined",
        "bodies.arrangement",
        "bodies.neighbours",
        "bodies.group_work",
        "bodies.group",
        "bodies.refine",
        "bodies.resisted",
        "bodies.interface",
        "bodies.free_motions",
        "bodies.elastic",
        "bodies.plates",
        "bodies.paths",
        "bodies.contributions",
        "bodies.punches",
    ],
    [
        "post.functional",
        "post.weights",
        "post.regular",
        "post.laws",
        "post.mixture",
        "post.conserve",
        "post.checks",
        "post.postprocess",
        "post.edge_laws",
        "post.fields",
        "post.smooth",
        "post.estimate",
    ],
    [
        "visuals.style",
        "visuals.offscreen",
        "visuals.field",
        "visuals.levels",
        "visuals.isolines",
        "visuals.subject",
        "visuals.axes",
        "visuals.curves",
        "visuals.depth",
        "visuals.plans",
        "visuals.scene",
        "visuals.relief",
        "visuals.pyvista",
        "visuals.matplotlib",
        "visuals.notebook",
    ],
    [
        "io.reader",
        "io.writing",
        "io.guarded",
        "io.cells",
        "io.tables",
        "io.meshes",
        "io.layers",
        "io.grounds",
        "io.polygons",
        "io.elements",
        "io.fields",
        "io.structures",
        "io.surfaces",
        "io.cases",
        "io",
    ],
    [
        "plans.tables",
        "plans.drawn_curves",
        "plans.drawings",
        "plans.read",
        "plans.problem",
        "plans.governing",
        "plans.search",
        "plans.solve",
    ],
    ["sweeps.records", "sweeps.orphans", "sweeps.workers", "sweeps.outcomes", "sweeps.run"],
    [
        "report.details",
        "report.numbers",
        "report.page",
        "report.pdf",
        "report.figures",
        "report.input",
        "report.results",
        "report.footing",
        "report.footings",
        "report.bearing",
        "report.depth",
        "report.sliding",
        "report.checks",
        "report.structure",
        "report.structures",
        "report.bodies",
        "report.cases",
        "report.data",
        "report",
    ],
    [
        "terminal",
        "cli.messages",
        "cli.files",
        "cli.pictures",
        "cli.outlines",
        "cli.footings",
        "cli.plates",
        "cli.tables",
        "cli.solve",
        "cli.grids",
        "cli.parser",
        "cli",
    ],
    ["__main__"],
]
ORDER = [module for layer in LAYERS for module in layer]
# allowed against the order: methods that make objects of the module above, and annotations
LATE = {
    ("grids.dual_mesh", "grids.cellwise"),
    ("solutions.pressures", "post.fields"),
    ("contact.measured", "io.surfaces"),
    ("ground.substrates", "ground.hankel"),
    ("solutions.pressures", "visuals.matplotlib"),
    ("solutions.group_solution", "visuals.matplotlib"),
    ("solutions.cases_solution", "io.cases"),
    ("solutions.pressures", "visuals.notebook"),
    ("solutions.group_solution", "visuals.notebook"),
    ("solutions.cases_solution", "visuals.notebook"),
    ("grids.dual_mesh", "visuals.notebook"),
    ("grids.report", "visuals.notebook"),
    ("plans.plan", "plans.read"),
    ("plans.plan", "visuals.plans"),
}
THIRD_PARTY = {
    "grids": {"numpy", "scipy", "skfem"},
    "kernels": {"numpy", "numba", "threadpoolctl", "tqdm"},
    "plans": {"numpy", "scipy", "skfem", "shapely", "ezdxf", "matplotlib"},
    "ground": {"numpy", "scipy"},
    "elements": {"numpy", "scipy", "skfem"},
    "operators": {"numpy", "scipy", "skfem"},
    "contact": {"numpy", "scipy", "skfem"},
    "solutions": {"numpy", "scipy", "skfem"},
    "bodies": {"numpy", "scipy", "skfem"},
    "post": {"numpy", "scipy", "skfem"},
    "visuals": {"numpy", "scipy", "skfem", "pyvista", "vtk", "vtkmodules", "matplotlib"},
    "report": {"numpy", "scipy", "skfem", "matplotlib", "weasyprint"},
}
#: a file of more lines is two things, and so is a function with a longer body
LONGEST_FILE, LONGEST_BODY = 400, 60
#: files that are longer nevertheless, and why
LONGER = {
    "contact.exact": "one page of public functions, all found at one path; most are docstrings",
}


def module_name(path):
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    return name.removesuffix(".__init__")


def imports(path):
    """Absolute names of all modules a file imports, also inside functions."""
    package = ["skfem_dual", *path.relative_to(ROOT).parent.parts]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            base = [*base, *(node.module.split(".") if node.module else [])]
            for alias in node.names:
                whole = ".".join([*base, alias.name])
                known = whole.removeprefix("skfem_dual.") in ORDER
                yield whole if known else ".".join(base)


FILES = {module_name(path): path for path in ROOT.rglob("*.py")}


def test_every_module_has_its_place():
    packages = {module_name(path) for path in ROOT.rglob("__init__.py")} - {"cli", "io", "report"}
    assert set(FILES) - packages == set(ORDER)


@pytest.mark.parametrize("name", [n for n in ORDER if n != "__main__"])
def test_imports_run_downhill(name):
    for target in imports(FILES[name]):
        if not target.startswith("skfem_dual"):
            continue
        inner = target.removeprefix("skfem_dual").removeprefix(".")
        if inner == "":  # the public names, for programs that use them all, and the version
            assert name.split(".")[0] in ("cli", "report")
        elif (name, inner) not in LATE:
            assert ORDER.index(inner) < ORDER.index(name), f"{name} imports {inner}"


@pytest.mark.parametrize("name", [n for n in ORDER if n.split(".")[0] in THIRD_PARTY])
def test_packages_each_stage_may_use(name):
    allowed = THIRD_PARTY[name.split(".")[0]] | set(sys.stdlib_module_names) | {"skfem_dual"}
    assert {target.split(".")[0] for target in imports(FILES[name])} <= allowed


def test_exact_solutions_share_nothing_with_what_they_judge():
    ours = {t for t in imports(FILES["contact.exact"]) if t.startswith("skfem_dual")}
    assert ours == {"skfem_dual.arguments"}


def bodies(tree):
    """Names of functions, those inside others too, and lines of their bodies but docstrings."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            told = ast.get_docstring(node, clean=False) is not None
            inner = node.body[1:] if told else node.body
            yield node.name, node.end_lineno - inner[0].lineno + 1 if inner else 0


def test_no_file_is_two_things():
    long = {name: len(path.read_text().splitlines()) for name, path in FILES.items()}
    long = {name: lines for name, lines in long.items() if lines > LONGEST_FILE}
    assert {name: lines for name, lines in long.items() if name not in LONGER} == {}


@pytest.mark.parametrize("name", sorted(FILES))
def test_no_function_is_two_things(name):
    found = bodies(ast.parse(FILES[name].read_text()))
    assert [(function, lines) for function, lines in found if lines > LONGEST_BODY] == []


def test_import_without_optional_packages():
    """Package and command line import with meshio, pyvista and matplotlib blocked, and parts of
    scipy that take long are imported where they are used."""
    code = (
        "import sys\n"
        "for name in 'meshio pyvista vtk vtkmodules matplotlib shapely ezdxf'.split():\n"
        "    sys.modules[name] = None\n"
        "import skfem_dual.cli\n"
        "late = 'scipy.optimize', 'scipy.interpolate', 'scipy.integrate'\n"
        "print([name for name in late if name in sys.modules])\n"
        "import skfem_dual.visuals.matplotlib, skfem_dual.visuals.pyvista\n"
        "from skfem import MeshTri\n"
        "dual = skfem_dual.DualMesh.from_mesh(MeshTri().refined(2))\n"
        "punch = skfem_dual.RigidPunch(skfem_dual.HalfSpace(1, 0), dual.basis())\n"
        "print(punch.solve(1.0, at=(0.5, 0.5)).success)\n"
    )
    found = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True
    )
    assert found.stdout.split() == ["[]", "True"]


def test_public_names_exist_and_are_documented():
    for name in skfem_dual.__all__:
        public = getattr(skfem_dual, name)
        doc = inspect.getdoc(public) or ""
        assert doc, name
        assert not doc.startswith(f"{name}("), name  # as dataclasses have by themselves
        if inspect.isfunction(public):
            told = set(re.findall(r"\w+", doc))
            assert set(inspect.signature(public).parameters) <= told, name
