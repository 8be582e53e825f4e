"""All of a report for other programs, as plain data under a schema with a version."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from .. import __version__
from ..ground.graded import GradedHalfSpace
from ..ground.layered import LayeredHalfSpace
from ..ground.substrates import Substrate
from .depth import below, governing
from .details import Details
from .footing import Footing, between

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


def report_data(footings: Sequence[Footing]) -> dict[str, Any]:
    """What the page of the same footings shows, as numbers, text, lists and dictionaries.

    All numbers are in the units that went in, ``None`` where a page has a dash. The fields are
    described in the guide, under "The report".
    """
    details = footings[0].details
    return {
        "schema": SCHEMA,
        "version": __version__,
        **_said(details),
        "substrate": substrate_data(footings[0].cases.footprint.substrate),
        "footings": [_footing(footing) for footing in footings],
        "between": [
            {
                "footings": [pair.first, pair.second],
                "distance": pair.distance,
                "differential_settlement": pair.difference,
                "angular_distortion": pair.distortion,
                "case": pair.case,
            }
            for pair in between(list(footings))
        ],
        "error": _error(footings[0]),
        "success": all(bool(footing.cases.success.all()) for footing in footings),
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


def substrate_data(ground: Substrate | str) -> Any:
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
    surface = {"young": ground.surface.young, "poisson": ground.surface.poisson}
    if isinstance(ground, GradedHalfSpace):
        return {"kind": "graded", **surface, "description": ground.description}
    return {"kind": "homogeneous", **surface}


def _said(details: Details) -> dict[str, Any]:
    return {
        "units": details.units.text,
        "title": details.title,
        "project": details.project,
        "author": details.author,
        "date": None if details.date is None else details.date.isoformat(timespec="seconds"),
        "mesh": details.mesh_name,
        "allowable": details.allowable,
        "remarks": list(details.remarks),
    }


def _footing(footing: Footing) -> dict[str, Any]:
    cases, standing = footing.cases, footing.standing
    footprint = cases.footprint
    p = footprint.partition.polygons.p
    found = below(governing(footing), footing.details.profile)
    envelope = cases.envelope() if cases.success.any() else ()
    return plain(
        {
            "name": footing.name,
            "grid": footprint.description,
            "cells": len(footprint.partition),
            "edge": footprint.edge,
            "collocation": footprint.collocation,
            "origin": footprint.origin,
            "centroid": footprint.centre,
            "area": footprint.partition.areas.sum(),
            "extent": [p.min(axis=1), p.max(axis=1)],
            "kern": None if standing is None or standing.kern is None else standing.kern.T,
            "accuracy": None if footing.accuracy is None else asdict(footing.accuracy),
            "points": [{"name": name, "x": x[0], "y": x[1]} for name, x in footing.points.items()],
            "circle_radius": footing.radius,
            "cases": [_case(footing, k) for k in range(len(cases))],
            "error": _error(footing),
            "envelope": [
                {"quantity": e.quantity, "value": e.value, "case": e.name} for e in envelope
            ],
            "stress_profile": None
            if found is None
            else {
                "case": cases.names[footing.governing],
                "point": found.profile.x,
                "depth": found.profile.depth,
                "stress": found.profile.stresses.sigma_z,
                "strain": found.profile.strain,
                "settlement": found.profile.displacement[2],
                "parts": {"depths": found.depths, "shortening": found.parts},
            },
        }
    )


def _case(footing: Footing, k: int) -> dict[str, Any]:
    cases = footing.cases
    solution, load = cases.solutions[k], cases.loads[k]
    given = {
        "force": load.force,
        "at": load.at,
        "moments": None if load.moments is None else (load.moments[1], -load.moments[0]),
        "settlement": load.settlement,
        "tilt": load.tilt,
        "horizontal": load.horizontal,
        "torsion": load.torsion,
    }
    case: dict[str, Any] = {
        "name": cases.names[k],
        "success": bool(cases.success[k]),
        "message": cases.messages[k],
        "load": given,
        "force": cases.force[k],
        "point": cases.point[:, k],
        **dict.fromkeys(FOUND),
    }
    if solution is None:
        return case
    mean, largest = footing.utilisation[:, k]
    ux, uy, twist = cases.sliding[:, k]
    if load.shear is not None:
        case |= {"displacement": [ux, uy], "twist": twist}
    return case | {
        "settlement": cases.settlement[k],
        "tilt": cases.tilt[:, k],
        "largest_settlement": cases.largest_settlement[k],
        "settlements": footing.settlements[k],
        "first_moments": solution.resultant[1:],
        "contact_area": solution.contact_area,
        "contact_share": cases.contact_share[k],
        "pressure": {
            "mean": footing.mean_pressure[k],
            "largest": cases.largest_pressure[k],
            "min_of_cells": solution.pressure.min(),
            "max_of_cells": solution.pressure.max(),
        },
        "utilisation": {"mean": mean, "largest": largest, "kern": footing.kern_use[k]},
        "edge_distance": footing.edge_distance[k],
        "iterations": solution.iterations,
        "complementarity_residual": solution.complementarity_residual,
        "displacement_residual": solution.displacement_residual,
        "resultant_residual": solution.resultant_residual,
        "seconds": solution.timings,
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
