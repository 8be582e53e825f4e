"""Every reference value beside ours: ``python docs/validation.py FOLDER`` writes the tables.

The values are exact solutions, or were computed by other methods than this package's; their
digits are trusted. The page is written from them whenever the documentation is built.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from skfem import BilinearForm, CellBasis, ElementQuad0, ElementTriArgyris, MeshTri
from skfem.helpers import dd, ddot, trace

from skfem_dual import (
    Cone,
    DualMesh,
    ElasticPunch,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    Plate,
    PunchSolution,
    RigidPunch,
    flexible_settlement,
    load_matrix,
)
from skfem_dual.contact import exact
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.generate import annulus, disc, polar, polygon, rectangle
from skfem_dual.io import read_mesh
from skfem_dual.solutions.below import stress_below

DISC = Path(__file__).parents[1] / "tests" / "data" / "disc.msh"
UNIT = HalfSpace(1.0, 0.0)  # E* = 1
SOIL = HalfSpace(1.0, 0.25)
#: dual cells of a plan
CELLS = 1200
#: lengths of facets on the edge of a plan over those inside
GRADED = 0.3


@dataclass(frozen=True)
class Row:
    """A quantity, its value known from elsewhere with the digits that are trusted, and ours.

    ``within`` is the goal for the difference, relative or, if so said, absolute.
    """

    what: str
    expected: str
    found: float
    within: float
    absolute: bool = False

    @property
    def difference(self) -> float:
        """Ours less the value known, over it unless absolute."""
        known = float(self.expected)
        return self.found - known if self.absolute else self.found / known - 1

    @property
    def met(self) -> bool:
        """Whether the difference is within the goal."""
        return abs(self.difference) <= self.within

    def __str__(self) -> str:
        mantissa, _, exponent = self.expected.partition("e")
        digits = len(mantissa.partition(".")[2])
        found = f"{self.found:.{digits}{'e' if exponent else 'f'}}".replace("e-0", "e-")
        difference = f"{self.difference:+.0e}".replace("e-0", "e-") if self.difference else "0"
        goal = f"{self.within:.0e}".replace("e-0", "e-") + " absolute" * self.absolute
        if not self.met:
            goal += ", **missed**"
        return f"| {self.what} | {self.expected} | {found} | {difference} | {goal} |"


Rows = Iterator[Row]
TABLES: dict[str, Callable[[], Rows]] = {}


def table(function: Callable[[], Rows]) -> Callable[[], Rows]:
    """Let `write_tables` know of a table; its file has the name of the function."""
    TABLES[function.__name__] = function
    return function


def write_tables(folder: Path) -> None:
    """Write all tables into a folder, as Markdown."""
    folder.mkdir(parents=True, exist_ok=True)
    head = "| quantity | known | ours | error | goal |\n|---|---|---|---|---|\n"
    for name, rows in TABLES.items():
        text = head + "".join(f"{row}\n" for row in rows())
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


def regular(sides: int) -> np.ndarray:
    """Corners of a regular polygon, shape (2, sides)."""
    angle = 2 * np.pi * np.arange(sides) / sides
    return np.stack([np.cos(angle), np.sin(angle)])


@cache
def plan(name: str) -> MeshTri:
    """The triangulations of the plans."""
    make = {
        "disc": lambda: disc(n=CELLS, graded=GRADED),
        "square": lambda: rectangle(2.0, 2.0, n=CELLS, graded=GRADED),
        "rectangle": lambda: rectangle(2.0, 4.0, n=CELLS, graded=GRADED),
        "annulus": lambda: annulus(0.5, 1.0, n=CELLS, graded=GRADED),
        "equilateral triangle": lambda: polygon(regular(3), n=CELLS, graded=GRADED),
        "hexagon": lambda: polygon(regular(6), n=CELLS, graded=GRADED),
        "uniform disc": lambda: disc(n=CELLS),
        "coarse disc": lambda: disc(n=CELLS // 2, graded=GRADED),
    }
    return make[name]()


def punch(ground, name: str, **options) -> RigidPunch:
    """A punch on the dual cells of a plan."""
    return RigidPunch(ground, DualMesh.from_mesh(plan(name)).basis(), **options)


@cache
def circle() -> RigidPunch:
    """The circle a = 1 on E = 1, nu = 1/4."""
    return punch(SOIL, "disc")


def around(solution: PunchSolution, r: float, wave: Callable = np.ones_like) -> float:
    """Amplitude of the pressure at a distance from the middle, as wave(angle)."""
    angle = np.linspace(0, 2 * np.pi, 96, endpoint=False) + 0.01
    p = solution.pressure_at(r * np.stack([np.cos(angle), np.sin(angle)]))
    return float(p @ wave(angle) / (wave(angle) @ wave(angle)))


@table
def rigid_circle() -> Rows:
    """Exact: homogeneous half-space, P = E a^2, nu = 1/4."""
    central, eccentric = circle().solve(1.0), circle().solve(1.0, (0.25, 0.0))
    yield Row("settlement $W_0 / a$, $P = E a^2$", "0.46875", central.settlement, 5e-5)
    for r in (0.0, 0.5, 0.8, 0.95):
        known = exact.circle_pressure([[r], [0.0]], 1.0, 1.0)[0]
        found = around(central, max(r, 0.02))
        yield Row(f"pressure $p a^2 / P$ at $r / a = {r:g}$", f"{known:.5f}", found, 3e-3)
    tilt = exact.circle_tilt(0.25, 1.0, 1.0, 0.25)
    yield Row("tilt, force at $0.25 a$", f"{tilt:.6f}", float(eccentric.tilt[0]), 2e-4)
    kern = np.hypot(*circle().kern()).mean()
    yield Row("eccentricity $e / a$ at which it lifts off", "0.33333", float(kern), 5e-4)
    depth = np.array([0.5, 1.0, 2.0])
    below = stress_below(central, np.stack([0 * depth, 0 * depth, depth])).sigma_z
    for z, found in zip(depth, below, strict=True):
        known = (1 + 3 * z**2) / (2 * np.pi * (1 + z**2) ** 2)
        what = rf"$\sigma_z a^2 / P$ on the axis at depth $z / a = {z:g}$"
        yield Row(what, f"{known:.6f}", float(found), 5e-4)


@table
def rigid_ellipse() -> Rows:
    """Exact: homogeneous half-space, E* = 1, P = 1."""
    for b in (0.5, 0.25):
        mesh = MeshTri(plan("disc").p * [[1.0], [b]], plan("disc").t)
        found = RigidPunch(UNIT, DualMesh.from_mesh(mesh).basis()).solve(1.0).settlement
        known = exact.ellipse_settlement(1.0, (1.0, b), 1.0, 0.0)
        yield Row(f"settlement $W_0 E^* a / P$, $b = {b:g} a$", f"{known:.6f}", found, 1e-4)


@table
def shaped() -> Rows:
    """Exact: sphere of radius 1 and cone; E* = 1, contact to about 0.8."""
    cases = (
        (
            "sphere",
            Paraboloid(1.0),
            4 / 3 * 0.8**3,
            exact.hertz_radius,
            exact.hertz_approach,
        ),
        ("cone", Cone(0.3), 0.32 * np.pi * np.tan(0.3), exact.cone_radius, exact.cone_approach),
    )
    for name, gap, force, radius, approach in cases:
        solution = punch(UNIT, "uniform disc", gap=gap).solve(force)
        size = gap.radius if name == "sphere" else gap.angle
        known = approach(force, size, 1.0, 0.0)
        yield Row(f"{name}: settlement", f"{known:.5f}", solution.settlement, 5e-4)
        known, found = radius(force, size, 1.0, 0.0), np.sqrt(solution.contact_area / np.pi)
        yield Row(f"{name}: radius of contact", f"{known:.4f}", float(found), 5e-3)
        if name == "sphere":
            known = 3 * force / (2 * np.pi * known**2)
            yield Row("sphere: largest pressure", f"{known:.5f}", solution.pressure.max(), 3e-3)


@table
def uniform_load() -> Rows:
    """Exact: a uniformly loaded disc, q = 1, a = 1."""
    basis = DualMesh.from_mesh(plan("uniform disc")).basis()
    for name, r in (("centre", 0.0), ("edge", 1.0), ("outside, $r = 2 a$", 2.0)):
        known = exact.uniform_circle_displacement(r, 1.0, 1.0, 1.0, 0.25)
        angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
        x = r * np.stack([np.cos(angle), np.sin(angle)])
        found = float(flexible_settlement(SOIL, basis, 1.0, x).mean())
        yield Row(f"$w E / (q a)$, {name}", f"{float(known):.6f}", found, 5e-5)


def stiffness(footing: RigidPunch, axis: int = 0) -> tuple[float, float]:
    """Force by settlement, and moment by tilt along an axis, of a solution in full contact."""
    arm = 0.1
    solution = footing.solve(1.0, (arm, 0.0) if axis == 0 else (0.0, arm))
    return 1 / solution.settlement, arm / float(solution.tilt[axis])


@table
def flat_plans() -> Rows:
    """Other methods: E* = 1."""
    square, rectangle = punch(UNIT, "square"), punch(UNIT, "rectangle")
    force, moment = stiffness(square)
    yield Row("square of half-side $a$: $C_v$", "0.733576", force / np.pi, 2e-4)
    yield Row("square: $C_r$", "0.662348", moment / np.pi, 5e-4)
    force, moment = stiffness(rectangle)
    yield Row("rectangle $2a \\times 4a$: $C_v$", "1.063836", force / np.pi, 2e-4)
    yield Row("rectangle: $C_r$ about the long axis", "1.171241", moment / np.pi, 5e-4)
    moment = stiffness(rectangle, 1)[1]
    yield Row("rectangle: $C_r$ about the short axis", "3.201667", moment / np.pi, 5e-4)
    force = stiffness(punch(UNIT, "annulus"))[0]
    yield Row("annulus $b / a = 0.5$: $C$", "0.6245354", force / np.pi, 2e-4)
    found = punch(SOIL, "square").solve(1.0).settlement
    yield Row("square, $P = E a^2$, $\\nu = 1/4$: $W_0 / a$", "0.406795", found, 2e-4)
    for name, known in (("equilateral triangle", "0.38123"), ("hexagon", "0.36121")):
        footing = punch(UNIT, name)
        found = stiffness(footing)[0] / np.pi / np.sqrt(footing.partition.areas.sum())
        yield Row(f"{name}: $C / \\sqrt{{A}}$", known, found, 5e-4)


@table
def motions() -> Rows:
    """Exact: a rigid circle, relaxed, and bonded to the ground."""
    nu, G = 0.25, 0.4
    found = punch(SOIL, "coarse disc").stiffness(full=True).diagonal()
    relaxed = (
        ("settlement", 4 / (1 - nu)),
        ("rocking", 8 / 3 / (1 - nu)),
        ("sliding", 8 / (2 - nu)),
        ("twisting", 16 / 3),
    )
    for (name, known), k in zip(relaxed, found[[0, 1, 3, 5]], strict=True):
        yield Row(f"{name}, stiffness over $G$", f"{known:.5f}", float(k / G), 3e-4)


@table
def bending() -> Rows:
    """Other methods: a circular plate that lifts off, P = a = E* = 1."""
    mesh, nu = disc(n=300), 0.2
    dual, plate = DualMesh.from_mesh(mesh), CellBasis(mesh, ElementTriArgyris())
    bent = BilinearForm(
        lambda u, v, w: (1 - nu) * ddot(dd(u), dd(v)) + nu * trace(dd(u)) * trace(dd(v))
    ).assemble(plate)
    middle = DualMesh.from_mesh(disc(radius=0.2, n=200))
    evenly = np.full(len(middle), 1 / middle.areas.sum())
    raft = ElasticPunch(UNIT, dual.basis(), plate, 0.1 / 12 / (1 - nu**2) * bent)
    morley = Plate(thickness=0.1 ** (1 / 3), young=1.0, poisson=nu).on(UNIT, dual.basis())
    s, by_morley = (
        body.solve(
            load_matrix(middle.partition, None, Fan.from_dual(middle), body.structure) @ evenly
        )
        for body in (raft, morley)
    )
    for what, solution, goal in (
        ("deflection in the middle, $w E^* a / P$", s, 1e-3),
        ("the same by `Plate`, of Morley's element", by_morley, 1e-2),
    ):
        yield Row(what, "1.381462", float(solution.deflection([0.0, 0.0])), goal)
    found = float(np.sqrt(s.contact_area / np.pi))
    yield Row("radius of contact over $a$", "0.7114", found, 2e-2)


@table
def lifting_off() -> Rows:
    """Other methods: P = a = E* = 1."""
    known = {
        0.35: ("0.4999", "0.2626", "0.988", "-0.91"),
        0.50: ("0.4821", "0.4190", "0.735", "-0.33"),
    }
    for e, (settlement, tilt, area, edge) in known.items():
        s = punch(UNIT, "disc").solve(1.0, (e, 0.0))
        line = max(s.contact_region.edge, key=np.size)
        yield Row(f"$e = {e:.2f} a$: settlement", settlement, s.settlement, 5e-4)
        yield Row("tilt", tilt, float(s.tilt[0]), 1e-3)
        yield Row("contact area over that of the circle", area, s.contact_area / np.pi, 3e-3, True)
        found = float(line[0, np.abs(line[1]).argmin()])
        yield Row("edge of contact on the axis, $x / a$", edge, found, 0.02, True)


def linear(gradient: float, poisson: float = 0.25) -> GradedHalfSpace:
    """E = 1 + gradient z."""
    return GradedHalfSpace.init_linear(1.0, poisson, gradient)


@cache
def grounds() -> dict:
    """Grounds by their names, with settlement and tilt of a rigid circle."""
    layer = [Layer(1.0, 1.0, 0.25)]
    bonded, smooth = (LayeredHalfSpace(layer, base) for base in ("bonded", "smooth"))
    soft = LayeredHalfSpace(layer, HalfSpace(0.1, 0.25))
    return {
        "$E_0 (1 + 0.1 z / a)$": (linear(0.1), "0.3884265445", "0.668060194"),
        "$E_0 (1 + 0.5 z / a)$": (linear(0.5), "0.2794736165", "0.571777662"),
        "$E_0 (1 + z / a)$": (linear(1.0), "0.2212284989", "0.496333765"),
        "the same, $\\nu = 1/2$": (linear(1.0, 0.5), "0.1498643676", "0.362765675"),
        "layer $a$, bonded": (bonded, "0.195493007289", "0.566018026363"),
        "layer $a$, smooth": (smooth, "0.2132017851", "0.5940602539"),
        "layer $a$ on $E_1 / 10$": (soft, "2.18606607872", "1.16856340458"),
    }


@table
def circle_on_grounds() -> Rows:
    """Other methods: W E0 a / P and tilt E0 a^3 / M."""
    for name, (ground, settlement, tilt) in grounds().items():
        force, moment = stiffness(punch(ground, "coarse disc"))
        yield Row(f"{name}: settlement", settlement, 1 / force, 1e-4)
        yield Row(f"{name}: tilt", tilt, 1 / moment, 5e-4)


@table
def pressure_on_grounds() -> Rows:
    """Other methods: p a^2 / P under a central force, p1 a^3 / M under a moment."""
    known = {
        "$E_0 (1 + z / a)$": (
            ("0.198725", "0.204275", "0.216509", "0.244841", "0.349874"),
            ("0.188913", "0.335494", "0.536315", "1.003679"),
        ),
        "layer $a$, bonded": (
            ("0.217678", "0.218453", "0.222557", "0.239970", "0.336733"),
            ("0.181006", "0.316469", "0.502423", "0.979357"),
        ),
    }
    radii = (0.0, 0.3, 0.5, 0.7, 0.9)
    for name, (central, tilting) in known.items():
        footing = punch(grounds()[name][0], "disc")
        upright = footing.solve(1.0)
        turned = footing.solve(1.0, (1.0, 0.0), unilateral=False)
        for r, p in zip(radii, central, strict=True):
            yield Row(f"{name}, force, $r / a = {r:g}$", p, around(upright, max(r, 0.02)), 2e-3)
        for r, p in zip(radii[1:], tilting, strict=True):
            yield Row(f"{name}, moment, $r / a = {r:g}$", p, around(turned, r, np.cos), 2e-3)


@table
def lift_off_on_grounds() -> Rows:
    """Other methods: e / a at which a circle begins to lift off."""
    for name, known in (("$E_0 (1 + z / a)$", "0.3080"), ("layer $a$, bonded", "0.2943")):
        found = np.hypot(*punch(grounds()[name][0], "disc").kern()).mean()
        yield Row(name, known, float(found), 5e-4)


@table
def influence_functions() -> Rows:
    """Other methods: E0 = a = 1."""
    ground = linear(1.0)
    for r, known in ((0.1, "2.2223031455"), (1.0, "0.08705057668"), (10.0, "1.26727275e-3")):
        yield Row(f"$E = 1 + z$: $\\omega({r:g})$", known, float(ground.influence(r)), 2e-9)
    for r, known in ((1.0, "0.144326675717"), (10.0, "0.402240751703")):
        yield Row(f"$E = 1 + z$: $\\Phi({r:g})$", known, float(ground.primitive(r)), 1e-9)
    for thickness, known in ((1.0, "0.8436644949"), (2.0, "1.2839458406")):
        layer = LayeredHalfSpace([Layer(thickness, 1.0, 0.25)], "bonded")
        found = 2 * np.pi * float(layer.primitive(1.0))
        what = f"bonded layer $H = {thickness:g} a$: centre of a uniformly loaded disc"
        yield Row(what, known, found, 1e-9)
    two = LayeredHalfSpace([Layer(1.0, 10.0, 0.5)], HalfSpace(1.0, 0.5))
    found = 2 * np.pi * float(two.primitive(1.0)) / 1.5
    what = "two layers, $\\nu = 1/2$, $E_1 = 10 E_2$: Burmister's $F_2$, centre of a disc"
    yield Row(what, "0.4864731942", found, 1e-9)
    for gradient, known in ((1e3, "0.99800"), (1e5, "0.99998")):
        found = 2 * np.pi * float(linear(gradient, 0.5).primitive(1.0)) * 2 * gradient / 3
        what = f"Gibson's limit, $E = 1 + 10^{{{np.log10(gradient):.0f}}} z$, $\\nu = 1/2$"
        yield Row(what, known, found, 2e-5)


@table
def printed() -> Rows:
    """The paper's own figures, its scheme: constant pressures, E a^2 = P, nu = 1/4."""
    grid = polar(10, 40, true_area=False)
    solution = RigidPunch(SOIL, CellBasis(grid, ElementQuad0()), edge="constant").solve(1.0)
    error = solution.pressure - exact.circle_pressure(solution.punch.collocation_points, 1.0, 1.0)
    areas = solution.punch.partition.areas
    yield Row("Table 1, polar grid: $S / a^2$", "3.12869", float(areas.sum()), 2e-6)
    yield Row("$W / a$", "0.47802", solution.settlement, 2e-5)
    yield Row("mean square error of the pressure", "4.3265e-3", float(np.mean(error**2)), 2e-5)
    scaled = solution.punch.matrix / solution.punch.matrix.sum(axis=1, keepdims=True)
    sigma = float(np.linalg.cond(scaled))
    yield Row(
        r"degree of conditionality $\sigma$, rows scaled to sums of one", "274.0", sigma, 1e-2
    )
    dual = DualMesh.from_mesh(read_mesh(DISC))
    yield Row("Figs 9, 10: triangles", "944", float(dual.mesh.nelements), 1e-12)
    yield Row("dual cells", "513", float(len(dual)), 1e-12)
    yield Row("$K_{TV}$", "1.84", dual.K_TV, 1e-3)
    solution = RigidPunch(SOIL, dual.basis(), edge="constant").solve(1.0)
    yield Row("$W / a$", "0.47216", solution.settlement, 1e-3)


if __name__ == "__main__":
    write_tables(Path(sys.argv[1]))
