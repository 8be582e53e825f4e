"""What the terminal shows of a solution."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..messages import decimals_of, place, shortened
from ..report.bodies import ReportedBody, between
from ..report.cases import CALLED
from ..report.footing import Footing
from ..solutions.punch_solution import PunchSolution
from ..units import Unit, Units
from .footings import Base
from .messages import in_options

#: coordinates that are zero but for rounding, over the extent of the plan
NOISE = 1e-12
#: characters of the name of a case in a table
NAME = 40


def solution_table(
    footing: Footing, base: Base, times: Mapping[str, float], condition: float | None
) -> str:
    """Names and values of one solution."""
    (solution,) = footing.cases.solutions
    rows = _base_rows(base)
    if solution is None:
        return _lines(rows)
    rows |= solution.table() | rows  # whose origin is told with why it is there
    del rows["Time [s]"]  # the solution's share of it
    units, e = footing.details.units, solution.centre_of_pressure
    size, where = np.ptp(base.mesh.p), "at no point"
    if not np.isnan(e).any():
        e = np.where(np.abs(e) < NOISE * size, 0.0, e)
        where = f"{_pair(e, units.length)} off the origin"
    if units.named:
        pressures = solution.pressure.min(), solution.pressure.max()
        low, high = (f"{p * units.pressure.factor:.6g}" for p in pressures)
        rows |= {
            "Settlement W0": _read(solution.settlement, units.displacement),
            "Tilt (Lx, Ly)": _pair(solution.tilt * units.slope.factor, units.slope),
            "Force, acting at": f"{_read(solution.acting_force, units.force)}, {where}",
            **_sliding(solution, units),
            "Contact area": _read(solution.contact_area, units.area),
            "Pressure mean": _read(solution.mean_pressure, units.pressure),
            "Pressure of cells": f"{low} to {high} {units.pressure.symbol}",
        }
    largest = footing.cases.largest_pressure[0]
    rows["Largest pressure"] = _read(largest, units.pressure, named=units.named)
    if footing.details.allowable is not None:
        mean, most = 100 * footing.utilisation[:, 0]
        known = f"mean {mean:.3g} %, largest {most:.3g} %"
        rows["Of the allowable"] = known if solution.success else "not known"
    for name, w in zip(footing.points, footing.settlements[0], strict=True):
        if name.startswith("P"):
            rows[f"Settlement {name}"] = _read(w, units.displacement, named=units.named)
    rows |= _bounds(footing, times)
    if condition is not None:
        rows["Condition number"] = f"{condition:.4g}"
    rows["Time [s]"] = _times(times)
    if not solution.success:
        rows["Success"] = "NO: the numbers above do not solve the problem"
    return _lines(rows)


def _sliding(solution: PunchSolution, units: Units) -> dict[str, str]:
    """Displacement and twist by horizontal loads."""
    shear = solution.shear
    if shear is None:
        return {}
    moved = _pair(shear.displacement * units.displacement.factor, units.displacement)
    force, torsion = _pair(shear.horizontal, units.force), _read(shear.torsion, units.moment)
    return {
        "Horizontal force": f"{force}, torsion {torsion}",
        "Displacement": f"{moved}, twist {_read(shear.twist, units.slope)}",
    }


def case_table(bodies: Sequence[ReportedBody], bases: Sequence[Base], times: Mapping) -> str:
    """A line for each case of each footing or plate, and their envelope."""
    units, lines = bodies[0].details.units, list[str]()
    for body, base in zip(bodies, bases, strict=True):
        lines += [_lines(_base_rows(base) | _plate_rows(body)), ""]
        shown = [
            [head, f"[{unit.symbol}]" if units.named else "", *_numbers(column * unit.factor)]
            for head, unit, column in _columns(body, units)
        ]
        share = [f"{100 * s:.3g} %" if np.isfinite(s) else "-" for s in body.contact_share]
        unsolved = body.details.unsolved
        names = ["case", "", *(shortened(name, NAME) for name in (*body.names, *unsolved))]
        found = ["", "", *_remarks(body)]
        told = [[*column, *["-"] * len(unsolved)] for column in (*shown, ["contact", "", *share])]
        table = [names, *told, [*found, *["NO SOLUTION"] * len(unsolved)]]
        widths = [max(map(len, column)) for column in table]
        for i, row in enumerate(zip(*table, strict=True)):
            if i != 1 or units.named:
                cells = [f"{c:>{w}}" for c, w in zip(row[1:], widths[1:], strict=True)]
                lines.append("  ".join([f"{row[0]:<{widths[0]}}", *cells]).rstrip())
        lines += ["", *_envelope(body)]
        moved = _points(body)
        if isinstance(body, Footing):
            moved |= _bounds(body, times)
        lines += [*(f"{name + ' ':<24}{line}" for name, line in moved.items()), ""]
    for pair in between(bodies):
        settled = _read(pair.difference, units.displacement, named=units.named)
        lines.append(
            f"{pair.first} to {pair.second}: differential settlement {settled}, 1 : "
            f"{1 / max(pair.distortion, 1e-12):.4g}, {pair.case}"
        )
    return "\n".join([*lines, f"{'Time [s]':<19}{_times(times)}"])


def _remarks(body: ReportedBody) -> list[str]:
    """What is to be known of cases beside their numbers."""
    pulls = [
        f"ground pulls on {100 * share:.3g} %" if share else "" for share in body.pulled_share
    ]
    return [pull if ok else "NO SOLUTION" for ok, pull in zip(body.success, pulls, strict=True)]


def _columns(body: ReportedBody, units: Units) -> list[tuple[str, Unit, np.ndarray]]:
    """What is told of each case."""
    sink, pressure = units.displacement, ("max press.", units.pressure, body.largest_pressure)
    if isinstance(body, Footing):
        (lx, ly), largest = body.tilts, body.cases.largest_settlement
        tilt = ("tilt Lx", units.slope, lx), ("tilt Ly", units.slope, ly)
        settled = "settlement", sink, body.cases.settlement
        return [settled, *tilt, ("max settl.", sink, largest), pressure, *_slides(body, units)]
    least, largest = body.deflections.T
    return [
        ("force", units.force, np.array([plan.force for plan in body.standings])),
        ("min defl.", sink, least),
        ("max defl.", sink, largest),
        ("max gap", sink, body.largest_gap),
        pressure,
    ]


def _slides(footing: Footing, units: Units) -> list[tuple[str, Unit, np.ndarray]]:
    """Displacements and twists of the cases by horizontal loads, if there are any."""
    if not any(load.shear is not None for load in footing.cases.loads):
        return []
    marks = units.displacement, units.displacement, units.slope
    return list(zip(("Ux", "Uy", "twist"), marks, footing.cases.sliding, strict=True))


def _plate_rows(body: ReportedBody) -> dict[str, str]:
    """What a plate is made of."""
    if isinstance(body, Footing) or body.plate is None:
        return {}
    plate, units = body.plate, body.details.units
    made = f"E {_read(plate.young, units.modulus, units.named)}, nu {plate.poisson:g}"
    return {"Plate": f"{_read(plate.thickness, units.length, units.named)} thick, {made}"}


def _points(body: ReportedBody) -> dict[str, str]:
    """Settlements or deflections of the points wanted, over all cases with success."""
    unit, named = body.details.units.displacement, body.details.units.named
    if not body.success.any():
        return {}
    what = "Settlement" if isinstance(body, Footing) else "Deflection"
    return {
        f"{what} {name}": f"{_read(w.min(), unit, False)} to {_read(w.max(), unit, named)}"
        for name, w in zip(body.points, body.settlements[body.success].T, strict=True)
        if name.startswith("P")
    }


def _envelope(body: ReportedBody) -> list[str]:
    units = body.details.units
    marks = {
        "largest_pressure": units.pressure,
        "largest_settlement": units.displacement,
        "deflection_difference": units.displacement,
        "slope": units.slope,
        "contact_share": Unit("%", 100.0),
    }
    rows = {
        CALLED[e.quantity]: (
            f"{_read(e.value, marks[e.quantity], named=units.named or e.quantity[0] == 'c')}"
            f", {e.name}"
        )
        for e in body.extremes
    }
    if rows and body.details.allowable is not None:
        rows["Of the allowable"] = f"{100 * np.nanmax(body.utilisation):.3g} %"
    width = max([24, *(len(name) + 2 for name in rows)])
    return [f"{name:<{width}}{value}" for name, value in rows.items()]


def _bounds(footing: Footing, times: Mapping[str, float]) -> dict[str, str]:
    """Between which values the settlement at the load is expected in the governing case."""
    standing, units = footing.standing, footing.details.units
    if standing is None:
        return {}
    called = f"Bounds of {footing.cases.names[footing.governing]}"
    name = "Bounds" if len(footing.cases) == 1 else called
    if "bounds" not in times:
        return {name: "not computed for so many cells. Remedy: --json or --report"}
    if (bounds := standing.bounds) is None:
        return {name: f"none: {in_options(standing.no_bounds)}"}
    low, high = (f"{w * units.displacement.factor:.6g}" for w in bounds.settlement)
    read = f" {units.displacement.symbol}" if units.named else ""
    by = "imposed" if "proven" in bounds.settlement_by else "expected"
    return {name: f"W at ({bounds.at[0]:.4g}, {bounds.at[1]:.4g}) {low} to {high}{read}, {by}"}


def _base_rows(base: Base) -> dict[str, str]:
    """What a footing is, and how its mesh was chosen."""
    x, y = np.where(np.abs(base.origin) < NOISE * np.ptp(base.mesh.p), 0.0, base.origin)
    origin = f"{place((x, y))}, {base.origin_is}"
    mesh = f"{base.path}, {len(base.dual)} nodes, {base.mesh.nelements} triangles"
    chosen = {} if base.accuracy is None else {"Accuracy": str(base.accuracy)}
    return {"Mesh": mesh, "Origin": origin} | chosen


def _lines(rows: Mapping[str, str]) -> str:
    return "\n".join(f"{name:<19}{value}" for name, value in rows.items())


def _numbers(values: np.ndarray) -> list[str]:
    decimals = decimals_of(values, 5)
    if decimals is None:
        return [f"{v:.5g}" if np.isfinite(v) else "-" for v in values]
    near = [f"{round(v, decimals) + 0.0:.{decimals}f}" for v in values]  # no -0
    return [
        "0" if v == 0 else text if np.isfinite(v) else "-"
        for v, text in zip(values, near, strict=True)
    ]


def _read(value: float, unit: Unit, named: bool = True) -> str:
    return f"{value * unit.factor:.6g}{f' {unit.symbol}' if named else ''}"


def _pair(x: np.ndarray, unit: Unit) -> str:
    return f"({x[0]:.5g}, {x[1]:.5g}) {unit.symbol}"


def _times(times: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {seconds:.3f}" for name, seconds in times.items())
