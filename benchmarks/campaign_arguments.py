"""Wrong arguments for every public callable, generated from the signatures.

Each parameter in turn takes values that are not meant for it, while the others are valid; arrays
also come in other byte orders, layouts and as lists, which must not change the answer.
"""

import importlib
import inspect
import re
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from skfem import Basis, BilinearForm, ElementTriMorley, ElementTriP1, LinearForm, Mesh, MeshTri
from skfem.helpers import dd, ddot

import skfem_dual
from skfem_dual.grids import generate

MODULES = ("contact.exact", "grids.generate", "io", "report", "visuals.matplotlib")
PICTURES = ("visuals.pyvista",)
#: made by the package only, or errors
ANSWERS = (
    *("CoupleEstimate", "ContactRegion", "DualMesh", "DualReport", "EdgeCoefficient", "LoadPath"),
    *("MeshReport", "Outcome", "MomentRotation", "PostprocessedPressure", "PreprocessReport"),
    *("PunchSolution", "PunchesSolution", "SmoothedCouple", "Stresses", "SweepResult", "Symmetry"),
)
#: errors a caller expects of wrong arguments; the others come from inside
EXPECTED = (TypeError, ValueError, OSError, MemoryError, NotImplementedError)


@dataclass(frozen=True)
class Call:
    """A public callable with arguments that are right."""

    name: str
    function: Callable
    valid: Mapping[str, Any]


@BilinearForm
def bending(u, v, w):
    """Stiffness of a plate."""
    return ddot(dd(u), dd(v))


@cache
def specimens() -> dict[str, Any]:
    """One small object of each kind, and an argument for each name of a parameter."""
    sd = skfem_dual
    folder = Path(tempfile.mkdtemp(prefix="campaign"))
    mesh = generate.disc(n=30)
    dual = sd.DualMesh.from_mesh(mesh)
    soil, basis = sd.HalfSpace(30.0, 0.25), dual.basis()
    punch = sd.RigidPunch(soil, basis)
    solution = punch.solve(1.0, at=(0.1, 0.05))
    triangles = sd.RigidPunch(soil, dual.primal_basis()).solve(1.0, at=(0.1, 0.05))
    lifted = punch.solve(1.0, at=(0.6, 0.0))
    away = mesh.translated((3.0, 0.0))
    two = MeshTri(
        np.hstack([mesh.p, away.p]), np.hstack([mesh.t, mesh.t + mesh.p.shape[1]])
    ).with_subdomains({"one": np.arange(mesh.nelements)})
    apart = sd.DualMesh.from_mesh(away).basis()
    couple = sd.GridCouple.from_dual(dual)
    outline = np.array([[0.0, 2, 2, 0], [0, 0, 1, 1]])
    points = np.array([[0.1, 0.3, -0.2, 0.0], [0.2, -0.1, 0.0, 0.4]])
    beside = sd.RigidPunch(soil, apart, origin=(3.0, 0.0))
    group = sd.RigidPunches([punch, beside])
    from skfem_dual import io  # needs a file for everything it reads

    meshes = folder / "mesh.vtu"
    mesh.save(str(meshes))
    io.write_dual(folder / "dual.vtu", dual)
    io.write_polygons(folder / "polygons.vtu", dual.polygons, {"p": dual.areas})
    (folder / "ground.toml").write_text("base = {young = 30.0, poisson = 0.25}\n")
    (folder / "plan.csv").write_text("0, 0\n2, 0\n2, 1\n0, 1\n")
    (folder / "heights.csv").write_text("0, 0.1\n0.2, 0\n")
    plate = Basis(mesh, ElementTriMorley())
    raft = sd.ElasticPunch(soil, basis, plate, bending.assemble(plate))
    weight = LinearForm(lambda v, w: 1.0 * v).assemble(plate)
    nodal = Basis(mesh, ElementTriP1())
    return {
        "mesh": mesh, "dual": dual, "basis": basis, "substrate": soil, "punch": punch,
        "solution": solution, "on_cells": solution, "on_triangles": triangles, "couple": couple,
        "grids": dual, "grid": dual, "x": points, "points": points, "pressure": solution.pressure,
        "force": 1.0, "radius": 1.0, "young": 30.0, "poisson": 0.25, "moment": 0.1, "angle": 0.1,
        "semiaxes": (1.0, 0.5), "r": np.array([0.5, 1.5]), "k": np.array([0.5, 1.5]),
        "moments": (0.1, 0.05), "centre": (0.1, 0.0), "origin": (0.1, 0.0), "at": (0.1, 0.0),
        "flat": 0.5, "rounding": 2.0, "thickness": 0.5, "gradient": 0.5, "ratio": 0.5,
        "length": 2.0, "exponent": 0.5, "offset": 1.0, "n": 30, "inner": 0.3, "outer": 1.0,
        "width": 2.0, "height": 1.0, "outline": outline, "rings": 3, "sectors": 8,
        "start": (-0.5, 0.0), "end": (0.5, 0.0), "depth": 1.0, "values": solution.pressure,
        "indicator": dual.areas, "fraction": 0.5, "F": dual.areas, "G": np.ones(mesh.nelements),
        "polygons": dual.polygons, "cell_data": {"p": dual.areas}, "fixed": [1, 2],
        "loads": [{"force": 1.0}, {"force": 1.0}], "load": {"force": 1.0}, "direction": (1.0, 0.0),
        "problem": punch.solve, "cases": [{"force": 1.0}], "gap": sd.Paraboloid(9.0),
        "make": lambda m: sd.RigidPunch(soil, sd.DualMesh.from_mesh(m).basis()),
        "names": ["one"], "joined": [[0, 1]], "punches": [punch], "old": 1.0, "new": 1.0,
        "A1": 1.0, "A2": 1.0, "layers": [sd.Layer(0.5, 30.0, 0.3)], "base": "bonded",
        "partition": dual.partition, "symmetry": "auto", "elem": ElementTriP1(),
        "elements": [0, 1],
        "path": folder / "out.vtu", "levels": [0.1, 0.2], "clim": (0.0, 1.0), "title": "title",
        "contact": lifted.contact_region, "couple_": triangles, "nodal": nodal, "two": two,
        "group": group, "folder": folder, "lifted": lifted, "tilt": (0.01, 0.0), "steps": 2,
        "refinements": 1, "i": np.array([0, 2]), "rtol": 1e-6, "radius_": np.array([0.5, 1.0]),
        "functions": [], "q": dual.areas, "write": lambda p: None, "settlement": 0.1,
        "middle": 2.0, "raft": raft, "structure": plate, "stiffness": raft.stiffness, "f": weight,
        "bodies": [beside, raft], "beside": beside, "corners": outline.T,
    }  # fmt: skip


def overrides() -> dict[str, dict[str, Any]]:
    """Arguments of some callables that differ from those of the same name elsewhere."""
    s = specimens()
    sd, folder = skfem_dual, s["folder"]
    deep = np.array([[0.1, 0.3], [0.2, -0.1], [0.5, 1.0]])
    profile = {"young": lambda z: 30.0 + z, "poisson": 0.25, "length": 2.0}
    graph = {"basis": s["basis"], "values": s["pressure"]}
    nodal = dict(zip(("basis", "values"), s["solution"].nodal_pressure()))
    nodal["pressure"] = nodal["basis"]
    return {
        "stress_below": {"solution": s["solution"], "x": deep},
        "displacement_below": {"solution": s["solution"], "x": deep},
        "vertical_section": {"n": 8},
        "vertical_profile": {"at": (0.1, 0.2), "depths": np.array([0.5, 1.0])},
        "settlement_by_layers": {"x": deep[:2], "depths": np.array([0.5, 1.0])},
        "Load": {"force": 1.0, "at": (0.1, 0.0)},
        "column_load": {"x": (0.1, 0.2)},
        "RigidPunch": {"origin": (0.0, 0.0)},
        "RigidPunch.solve": {"force": 1.0, "at": (0.1, 0.0)},
        "CasesSolution.write": {"path": folder / "cases.csv"},
        "RigidPunch.works": None, "RigidPunches.works": None,
        "RigidPunch.pressures_of": {"start": s["solution"]},
        "ElasticPunch": {"origin": (0.0, 0.0)},
        "ElasticPunch.solve_many": {"F": [s["f"]]},
        "ElasticPunch.checked_loads": {"f": s["f"], "x": s["f"]},
        "Plan.mesh": {"n": 40},
        "Plan.refine": {"mesh": instances()["Plan"].mesh(n=40)},
        "Punches.solve": {"loads": [s["load"], s["f"]]},
        "Plan.read": {"path": folder / "plan.csv"},
        "Plan.from_rings": {"rings": sd.Plan.circle((0.0, 0.0), 1.0).rings},
        "MeasuredProfile.read": {"path": folder / "heights.csv", "spacing": (1.0, 1.0)},
        "InfluenceOperator.dot": {"x": s["dual"].areas},
        "InfluenceOperator.roughly": {"q": s["dual"].areas[:, None]},
        "InfluenceOperator.coarsely": None,
        "RigidPunches.over_edge": {"pressure": np.ones(len(s["group"].cells))},
        "RigidPunches": {"punches": [s["punch"]], "joined": []},
        "RigidPunches.solve_many": {"cases": [[s["load"]] * 2]},
        "RigidPunches.from_subdomains": {"mesh": s["two"], "names": ["one"], "joined": []},
        "GradedHalfSpace": profile,
        "GradedHalfSpace.init_profile": profile,
        "GradedHalfSpace.init_linear": {"gradient": 0.5},
        "MeasuredProfile": {"x": s["points"], "height": np.array([0.0, 0.1, 0.0, 0.2])},
        "HalfSpace.primitive": {"radius": s["radius_"]},
        "GridCouple": {
            name: getattr(s["couple"], name)
            for name in ("kind", "a", "b", "node_in_a", "node_in_b", "ribs", "unbounded")
        },
        "CellwiseBasis": {"dual": s["dual"], "grid": "dual"},
        "rectangular_couple": {"x": np.arange(5.0), "y": np.arange(4.0)},
        "delaunay_voronoi": {"points": np.array([[0, 2, 1, 3.0], [0, 0, 1.5, 1.6]])},
        "Weights": {"A1": 1.0, "A2": 1.0},
        "InfluenceOperator": {"substrate": s["substrate"], "basis": s["basis"]},
        "InfluenceOperator.of_cells": {"x": s["dual"].centroids},
        "Symmetry.detect": {"partition": s["partition"]},
        "Symmetry.apply": None,
        "LayeredHalfSpace.compliance": {"k": np.array([0.5, 1.5])},
        "sweep": {"problem": s["problem"], "cases": s["cases"]},
        "refine_to_contact": {"load": {"force": 1.0, "at": (0.6, 0.0)}, "refinements": 1},
        "flexible_settlement": {"pressure": s["pressure"], "x": s["points"]},
        "contact.exact.circle_pressure": {"moments": (0.1, 0.0)},
        "contact.exact.uniform_circle_displacement": {"pressure": 1.0},
        "grids.generate.disc": {"n": 30, "centre": (0.1, 0.0)},
        "grids.generate.annulus": {"inner": 0.3, "n": 60, "hole": (0.1, 0.0)},
        "grids.generate.rectangle": {"width": 2.0, "height": 1.0, "n": 30},
        "grids.generate.polygon": {"outline": s["outline"], "n": 30},
        "io.read_mesh": {"path": folder / "mesh.vtu"},
        "io.read_dual": {"path": folder / "dual.vtu"},
        "io.read_polygons": {"path": folder / "polygons.vtu"},
        "io.read_substrate": {"path": folder / "ground.toml"},
        "io.write_polygons": {"cell_data": {"p": s["dual"].areas}},
        "io.write_whole": {"path": folder / "whole.txt", "write": lambda p: Path(p).touch()},
        "report.write_report": {"path": folder / "report.html"},
        "report.report_html": {"couple": s["on_triangles"]},
        "visuals.matplotlib.draw": {"grid": s["mesh"]},
        "visuals.matplotlib.plot_edge_coefficient": {
            "coefficient": s["solution"].edge_coefficient()
        },
        "visuals.matplotlib.plot_moment_rotation": {
            "curve": sd.moment_rotation(s["punch"], 1.0, steps=2)
        },
        "visuals.pyvista.draw": {"grid": s["mesh"]},
        "visuals.matplotlib.plot": graph, "visuals.matplotlib.isobars": nodal,
        "visuals.pyvista.plot": graph, "visuals.pyvista.isobars": nodal,
    }  # fmt: skip


def instances() -> dict[str, Any]:
    """Objects whose methods are called."""
    s, sd = specimens(), skfem_dual
    return {
        "RigidPunch": s["punch"],
        "RigidPunches": s["group"],
        "ElasticPunch": s["raft"],
        "ElasticSolution": s["raft"].solve(s["f"]),
        "Punches": sd.Punches(s["bodies"]),
        "CasesSolution": s["punch"].solve_many([s["load"]]),
        "Plan": sd.Plan.from_polygon(s["corners"]),
        "PunchSolution": s["solution"],
        "DualMesh": s["dual"],
        "GridCouple": s["couple"],
        "CellwiseBasis": s["basis"],
        "HalfSpace": s["substrate"],
        "LayeredHalfSpace": sd.LayeredHalfSpace([sd.Layer(0.5, 30.0, 0.3)], "bonded"),
        "InfluenceOperator": sd.InfluenceOperator(s["substrate"], s["basis"]),
    }


def calls(pictures: bool = False) -> Iterator[Call]:
    """All public functions, constructors and methods for which arguments are known."""
    known = overrides()
    for name, function in _public(pictures):
        try:
            parameters = inspect.signature(function).parameters
        except ValueError:  # exceptions
            continue
        given = known.get(name, {})
        if given is None:
            continue
        given = {key: value for key, value in given.items() if key in parameters}
        s = specimens()
        needed = [
            p.name for p in parameters.values()
            if p.default is p.empty and p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)
        ]  # fmt: skip
        if parameters and all(n in given or n in s for n in needed):
            yield Call(name, function, {n: s[n] for n in needed if n not in given} | given)


def _public(pictures: bool) -> Iterator[tuple[str, Callable]]:
    objects = instances()
    for name in () if pictures else skfem_dual.__all__:
        thing = getattr(skfem_dual, name)
        if not inspect.isclass(thing) or name not in ANSWERS:
            yield name, thing
        if not inspect.isclass(thing):
            continue
        for key, member in vars(thing).items():
            if key.startswith("_"):
                continue
            if isinstance(member, (classmethod, staticmethod)):
                yield f"{name}.{key}", getattr(thing, key)
            elif inspect.isfunction(member) and name in objects:
                yield f"{name}.{key}", getattr(objects[name], key)
    for module in PICTURES if pictures else MODULES:
        for name, thing in list(vars(importlib.import_module(f"skfem_dual.{module}")).items()):
            if inspect.isfunction(thing) and not name.startswith("_"):
                if "visuals" in module and not name.startswith(("draw", "plot", "isobars")):
                    continue
                home = thing.__module__.removeprefix("skfem_dual.")
                if home == module or (module == "visuals.matplotlib" and "visuals" in home):
                    yield f"{module}.{name}", thing


def wrong_values(right: Any) -> Iterator[tuple[str, Any]]:
    """Values that are not meant for a parameter with this right value; some may do."""
    s = specimens()
    yield from {
        "None": None, "True": True, "text": "rim", "empty text": "", "bytes": b"rim", "3": 3,
        "-1": -1, "0": 0, "half": 0.5, "1e308": 1e308, "-1e308": -1e308, "1e-308": 1e-308,
        "denormal": 5e-324, "10**400": 10**400, "-10**400": -(10**400), "nan": np.nan,
        "inf": np.inf, "-inf": -np.inf, "complex": 1j, "object": object(), "class": type(right),
        "dict": {}, "empty list": [], "empty tuple": (), "set": {1, 2}, "list": [1.0, 2.0],
        "triple": (1.0, 2.0, 3.0), "texts": ["a", "b"], "Nones": [None, None],
        "ragged": [[1], [2, 3]],
        "pair of nan": (np.nan, 0.0), "pair of 1e308": (1e308, 1e308), "huge ints": [10**400, 1],
        "function": len, "mesh": s["mesh"], "dual": s["dual"], "basis": s["nodal"],
        "solution": s["lifted"], "empty array": np.zeros(0), "matrix": np.zeros((3, 3)),
        "complex array": np.ones(2, complex), "objects": np.array([None, 1], object),
        "text array": np.array(["a", "b"]), "bool array": np.array([True, False]),
        "nan array": np.full((2, 3), np.nan), "scalar array": np.array(0.5),
    }.items()  # fmt: skip
    if isinstance(right, np.ndarray) and right.dtype.kind in "iuf":
        other = right.copy().astype(float)
        if other.size:
            for name, value in (("nan", np.nan), ("inf", np.inf), ("1e308", 1e308)):
                bad = other.copy()
                bad.flat[-1] = value
                yield f"{name} inside", bad
            yield "one less", right[..., :-1]
        yield from {
            "transposed": right.T[..., None] if right.ndim == 1 else right.T,
            "one dimension more": right[None], "flat": right.ravel()[: right.size - 1],
            "of complex": right + 1j, "of objects": right.astype(object),
            "of texts": right.astype(str), "negative": -right - 1,
        }.items()  # fmt: skip
    if isinstance(right, Mapping):
        yield from {"unknown key": {"colour": 1.0}, "no text as key": {1: 2.0}}.items()


def same_values(right: Any) -> Iterator[tuple[str, Any]]:
    """The right value in other forms that must give the same answer."""
    if isinstance(right, np.ndarray) and right.dtype.kind in "iuf":
        swapped = right.astype(right.dtype.newbyteorder("S"))
        frozen = right.copy()
        frozen.setflags(write=False)
        yield from {
            "swapped bytes": swapped, "as list": right.tolist(), "read-only": frozen,
            "by columns": np.asfortranarray(right), "strided": np.repeat(right, 2, -1)[..., ::2],
        }.items()  # fmt: skip
    elif isinstance(right, float):
        yield from {"numpy float": np.float64(right), "array": np.array(right)}.items()
    elif isinstance(right, tuple) and right and all(isinstance(x, float) for x in right):
        yield from {"as array": np.array(right), "swapped bytes": np.array(right, ">f8")}.items()
    elif isinstance(right, int):
        yield from {"numpy int": np.int64(right), "small int": np.int16(right)}.items()


def trials(
    seed: int = 0, pictures: bool = False
) -> Iterator[tuple[str, Callable[[], tuple[str, str]]]]:
    """Label and judged call, in the order of the names; nothing is drawn at random."""
    for call in calls(pictures):
        parameters = inspect.signature(call.function).parameters.values()
        yield call.name, lambda call=call: judged(call, "", None, None)
        for p in parameters:
            if p.kind in (p.VAR_KEYWORD, p.VAR_POSITIONAL):
                continue
            default = None if p.default is p.empty else p.default
            right = call.valid.get(p.name, default)
            for what, value in wrong_values(right):
                label = f"{call.name}({p.name}={what})"
                yield label, lambda c=call, n=p.name, v=value: judged(c, n, v, None)
            for what, value in same_values(right):
                label = f"{call.name}({p.name}={what})"
                yield label, lambda c=call, n=p.name, v=value, r=right: judged(c, n, v, r)


def judged(call: Call, name: str, value: Any, right: Any) -> tuple[str, str]:
    """How a call ended, in the words of the table, and what it said."""
    arguments = dict(call.valid)
    if name:
        arguments[name] = value
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            answer = call.function(**arguments)
            if right is not None and numbers(answer) != (
                expected := numbers(call.function(**{**arguments, name: right}))
            ):
                a, b = (np.array(x, dtype=float) for x in (numbers(answer), expected))
                if a.shape != b.shape or not np.allclose(a, b, 1e-10, 1e-12, equal_nan=True):
                    return "wrong", "another answer than of the same numbers in an ordinary array"
            if (
                getattr(answer, "success", False) is True
                and not np.isfinite(numbers(answer)).all()
            ):
                return "wrong", "success with numbers that are not finite"
    except skfem_dual.ConvergenceError as error:
        return "clear", str(error)
    except Exception as error:  # noqa: BLE001
        return ("unclear" if not name or right is not None else clarity(error, name)), (
            f"{type(error).__name__}: {error}"
        )
    return "fine", ""


def clarity(error: Exception, name: str) -> str:
    """Whether an error names the argument, or was raised by the package in its own words."""
    if not isinstance(error, EXPECTED):
        return "unclear"
    if isinstance(error, (OSError, MemoryError)):
        return "clear"
    frames = traceback.extract_tb(error.__traceback__)
    ours = "skfem_dual" in Path(frames[-1].filename).parts
    text = str(error)
    named = re.search(rf"(?<!\w){re.escape(name)}(?!\w)", text) is not None
    helps = ours and ("expected" in text or "Remedy" in text)
    return "clear" if named or helps else "unclear"


def numbers(answer: Any) -> list[float]:
    """All numbers of an answer, one after the other."""
    if isinstance(answer, np.ndarray):
        return answer.astype(float).ravel().tolist() if answer.dtype.kind in "biuf" else []
    if isinstance(answer, (bool, int, float, np.number)):
        return [float(answer)] if abs(answer) < 1e300 else []
    if isinstance(answer, (list, tuple)):
        return [x for part in answer for x in numbers(part)]
    if isinstance(answer, Mesh):
        return numbers([answer.p, answer.t])
    if is_dataclass(answer) and not isinstance(answer, type):
        skipped = ("timings", "punch", "punches", "load", "seconds", "case")
        return numbers([getattr(answer, f.name) for f in fields(answer) if f.name not in skipped])
    return []
