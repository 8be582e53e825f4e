"""All of a report for other programs, as plain data under a schema with a version."""

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from .. import __version__
from ..contact.load import Load, Share
from ..ground.graded import GradedHalfSpace
from ..ground.layered import LayeredHalfSpace
from ..ground.periodic import PeriodicGround
from ..ground.substrates import HalfSpace, Substrate
from ..io import CaseRow
from ..solutions.pressures import CellPressures
from .bodies import ReportedBody, between
from .depth import below, governing_solution
from .details import Details
from .footing import Footing
from .input import shape_of
from .structure import imposed_on
from .structures import Structure

#: name and version of the schema; fields may be added under the same number
SCHEMA = "skfem-dual/1"
#: fields of a case that are known with a solution, or with horizontal loads, only
FOUND = (
    "settlement",
    "tilt",
    "largest_settlement",
    "settlements",
    "first_moments",
    "contact_area",
    "contact_share",
    "pressure",
    "utilisation",
    "edge_distance",
    "iterations",
    "complementarity_residual",
    "displacement_residual",
    "resultant_residual",
    "seconds",
    "displacement",
    "twist",
)


def report_data(bodies: Sequence[ReportedBody]) -> dict[str, Any]:
    """What the page of the same bodies shows, as numbers, text, lists and dictionaries; without
    the strength at the edge, which `edge_coefficient` has.

    All numbers are in the units that went in, ``None`` where a page has a dash. The fields are
    described in the guide, under "The report".

    Parameters
    ----------
    bodies : list of Footing and Structure
        From `bodies_of`, at least one.
    """
    details = bodies[0].details
    footings = [body for body in bodies if isinstance(body, Footing)]
    return {
        "schema": SCHEMA,
        "version": __version__,
        **_said(details),
        "substrate": substrate_data(bodies[0].plan.substrate),
        "footings": [_footing(footing) for footing in footings],
        "structures": [_structure(body) for body in bodies if isinstance(body, Structure)],
        "between": [
            {
                "footings": [pair.first, pair.second],
                "distance": pair.distance,
                "differential_settlement": pair.difference,
                "angular_distortion": pair.distortion,
                "case": pair.case,
            }
            for pair in between(bodies)
        ],
        "error": _error(footings[0]) if footings else None,
        "success": all(bool(body.success.all()) for body in bodies) and not details.unsolved,
        # what a run of the command line adds
        "condition_number": None,
        "seconds": None,
    }


def plain(value: Any) -> Any:
    """The same as JSON knows it: lists for arrays, None for numbers that are not finite."""
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not np.isfinite(value) else value


def substrate_data(ground: Substrate | PeriodicGround | str) -> Any:
    """A ground as data: its kind and its numbers; a rigid base by its word."""
    if isinstance(ground, str):
        return ground
    if isinstance(ground, LayeredHalfSpace):
        layers = [
            {
                "thickness": layer.thickness,
                "young": layer.young,
                "poisson": layer.poisson,
                "gradient": layer.gradient,
            }
            for layer in ground.layers
        ]
        return {"kind": "layered", "layers": layers, "base": substrate_data(ground.base)}
    if isinstance(ground, PeriodicGround):
        period = list(ground.period)
        return {"kind": "periodic", "period": period, "ground": substrate_data(ground.ground)}
    surface = {"young": ground.surface.young, "poisson": ground.surface.poisson}
    if isinstance(ground, HalfSpace):
        return {"kind": "homogeneous", **surface}
    description = getattr(ground, "description", str(ground))
    kind = "graded" if isinstance(ground, GradedHalfSpace) else "other"
    return {"kind": kind, **surface, "description": description}


def _said(details: Details) -> dict[str, Any]:
    return {
        "units": details.units.text,
        "title": details.title,
        "project": details.project,
        "author": details.author,
        "date": _written(details.date),
        "mesh": details.mesh_name,
        "allowable": details.allowable,
        "remarks": list(details.remarks),
    }


def _written(date: datetime.date | None) -> str | None:
    """In the format of ISO 8601, with the time of day if it has one."""
    if isinstance(date, datetime.datetime):
        return date.isoformat(timespec="seconds")
    return None if date is None else date.isoformat()


def _footing(footing: Footing) -> dict[str, Any]:
    cases, standing = footing.cases, footing.standing
    return plain(
        {
            **_plan(footing),
            "kern": None if standing is None or standing.kern is None else standing.kern.T,
            "accuracy": None if footing.accuracy is None else asdict(footing.accuracy),
            "cases": _cases(footing, [_case(footing, k) for k in range(len(cases))]),
            "error": _error(footing),
            "stress_profile": _profile(footing, governing_solution(footing)),
        }
    )


def _cases(body: ReportedBody, found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Cases, and those of which there is no solution at all."""
    return found + body.without_solution(found[0], None)


def _plan(body: ReportedBody) -> dict[str, Any]:
    """What is told of every body."""
    footprint = body.plan
    # shaped punches are solved again where pressures reach the edge of the plan
    punch = None if body.standing is None else body.standing.solution.punch
    p = footprint.hull
    return {
        "name": body.name,
        "grid": footprint.description,
        "cells": len(footprint.partition),
        "edge": (footprint if punch is None else punch.footprint).edge,
        "edge_boundaries": footprint.edge_boundaries,
        "collocation": footprint.collocation,
        "shape": None if punch is None else shape_of(punch.gap),
        "origin": footprint.origin,
        "centroid": footprint.centre,
        "area": footprint.partition.areas.sum(),
        "extent": [p.min(axis=1), p.max(axis=1)],
        "points": [{"name": name, "x": x[0], "y": x[1]} for name, x in body.points.items()],
        "circle_radius": body.radius,
        "envelope": [
            {"quantity": e.quantity, "value": e.value, "case": e.name} for e in body.extremes
        ],
    }


def _profile(body: ReportedBody, solution: CellPressures | None) -> dict[str, Any] | None:
    """The ground below it in its governing case."""
    found = below(solution, body.details.profile)
    return found and {
        "case": body.names[body.governing],
        "point": found.profile.x,
        "depth": found.profile.depth,
        "stress": found.profile.stresses.sigma_z,
        "strain": found.profile.strain,
        "settlement": found.profile.displacement[2],
        "parts": {"depths": found.depths, "shortening": found.parts},
    }


def _structure(body: Structure) -> dict[str, Any]:
    punch, plate = body.standing.solution.punch, body.plate
    elements = punch.structure
    return plain(
        {
            **_plan(body),
            "kind": "plate" if punch.boundary is None else "solid",
            "plate": None if plate is None else asdict(plate),
            "columns": [_column(body, row) for row in body.columns],
            "element": type(elements.elem).__name__,
            "elements": elements.mesh.nelements,
            "dofs": elements.N,
            "held": len(punch.compliance.fixed),
            "areas": punch.partition.areas,
            "centroids": punch.partition.centroids.T,
            "cases": _cases(body, [_structure_case(body, k) for k in range(len(body.names))]),
            "stress_profile": _profile(body, body.standing.solution),
        }
    )


def _column(body: Structure, row: CaseRow) -> dict[str, Any]:
    """What stands on it in a case."""
    (x, y), (bx, by), (mx, my) = row.point(body.plan.origin), row.sides, row.moments
    place = {"x": x, "y": y, "bx": bx, "by": by}
    return {"case": row.name, "force": row.force, **place, "mx": mx, "my": my, "q": row.spread}


def _structure_case(body: Structure, k: int) -> dict[str, Any]:
    """What was found; loads as resultants from the origin, pressures in every cell."""
    solution, moments = body.solutions[k], None
    if body.plate is not None:
        ends = [(m.min(), m.max()) for m in body.plate.moments(solution)]
        moments = dict(zip(("mx", "my", "mxy"), ends, strict=True))
    return {
        "name": body.names[k],
        "success": solution.success,
        "message": solution.message,
        "load": dict(zip(("force", "mx", "my"), imposed_on(solution)[[0, 2, 1]], strict=True)),
        "force": solution.force,
        "point": body.acting_points[:, k],
        "reactions": solution.vertical_reaction,
        "deflection": {"least": body.deflections[k, 0], "largest": body.deflections[k, 1]},
        "mean_settlement": body.mean_settlement[k],
        "largest_gap": body.largest_gap[k],
        "moments": moments,
        **_pressed(body, k, solution),
        "in_cells": {
            "pressure": solution.pressure,
            "first_moments": solution.mean_moments.T,
            "deflection": solution.cell_deflections,
            "gap": solution.gap,
        },
        "equilibrium_residual": solution.equilibrium_residual,
    }


def _pressed(body: ReportedBody, k: int, solution: CellPressures) -> dict[str, Any]:
    """What is told of every body in a case with a solution."""
    mean, largest = body.utilisation[:, k]
    return {
        "settlements": body.settlements[k],
        "first_moments": solution.resultant[1:],
        "contact_area": solution.contact_area,
        "contact_share": body.contact_share[k],
        "pressure": {
            "mean": body.mean_pressure[k],
            "largest": body.largest_pressure[k],
            "min_of_cells": solution.pressure.min(),
            "max_of_cells": solution.pressure.max(),
        },
        "utilisation": {"mean": mean, "largest": largest},
        "iterations": solution.iterations,
        "complementarity_residual": solution.complementarity_residual,
        "displacement_residual": solution.displacement_residual,
        "seconds": solution.timings,
    }


def _given(load: Load) -> dict[str, Any]:
    """What was imposed."""
    return {
        "force": load.force,
        "at": load.at,
        "moments": None if load.moments is None else (load.moments[1], 0.0 - load.moments[0]),
        "settlement": load.settlement,
        "tilt": load.tilt,
        "horizontal": load.horizontal,
        "torsion": load.torsion,
    }


def _case(footing: Footing, k: int) -> dict[str, Any]:
    cases = footing.cases
    solution, load = cases.solutions[k], cases.loads[k]
    imposed, body = _given(load), {}
    if isinstance(load, Share):
        imposed = dict.fromkeys(imposed)
        body = {"load_of_body": {"punches": load.names, **_given(load.body)}}
    case: dict[str, Any] = {
        "name": cases.names[k],
        "success": bool(cases.success[k]),
        "message": cases.messages[k],
        "load": imposed,
        **body,
        "force": cases.force[k],
        "point": cases.point[:, k],
        **dict.fromkeys(FOUND),
    }
    if solution is None:
        return case
    ux, uy, twist = cases.sliding[:, k]
    if load.shear is not None:
        case |= {"displacement": [ux, uy], "twist": twist}
    pressed = _pressed(footing, k, solution)
    return case | {
        "settlement": cases.settlement[k],
        "tilt": cases.tilt[:, k],
        "largest_settlement": cases.largest_settlement[k],
        **pressed,
        "utilisation": pressed["utilisation"]
        | {"kern": footing.kern_use[k], "overturning": footing.overturning_use[k]},
        "edge_distance": footing.edge_distance[k],
        "resultant_residual": solution.resultant_residual,
    }


def _error(footing: Footing) -> dict[str, Any] | None:
    """Between which values the exact position is expected in the governing case."""
    standing = footing.standing
    if standing is None:
        return None
    return plain(
        {
            "case": footing.cases.names[footing.governing],
            "bounds": None if standing.bounds is None else asdict(standing.bounds),
            "no_bounds": standing.no_bounds,
        }
    )
