"""Closed lines of DXF drawings."""

from collections import Counter
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..errors import MeshError, MeshWarning, warn
from ..messages import place
from .drawn_curves import arcs_of
from .tables import Corner

#: ends of lines nearer to each other than this part of the drawing are joined
NEAR = 1e-6
#: extent of a drawing, over that of its largest shape, from which on something in it lies astray
ASTRAY = 1e4
#: rise of a shape over its extent up to which it lies in the plane, where it is shorter by 1e-9
TILT = 4.5e-5
#: degrees by which an arc of a whole turn may be off
WHOLE = 1e-6
#: units of drawings that ezdxf has no symbols of
SURVEY = {
    number: f"US survey {unit}" for number, unit in zip(range(21, 25), ("ft", "in", "yd", "mi"))
}
#: flag of vertices of polylines that only steer a curve
FRAME_POINT = 16
#: shapes that make rings
SHAPES = {"LINE", "ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE", "ELLIPSE", "SPLINE"}
#: what some of them must have
NEEDED = {
    "LINE": ("start", "end"),
    "ARC": ("center", "radius", "start_angle", "end_angle"),
    "CIRCLE": ("center", "radius"),
}

#: corners (2, n), bulges of the sides that start in them, whether the last one closes a ring
Shape = tuple[ndarray, ndarray, bool]
#: a piece of an outline: corners (2, n), bulges of the sides between them
Piece = tuple[ndarray, ndarray]


def rings_of_drawing(path: Path, layer: str | None, tol: float | None) -> list[list[Corner]]:
    """Rings of a drawing.

    Raises
    ------
    MeshError
        If there are none, a line is not closed or branches, or the layer is not told.
    """
    entities = list(_drawing(path).modelspace())
    if not any(_counts(e, layer) for e in entities):
        entities = _exploded(entities, path)
    entities = _on_layer(entities, layer, path)
    found = [_piece(entity, path) for entity in entities]
    if tol is None:
        tol = _tolerance(found, path)
    found = _distinct(found, tol, path)
    rings = [np.vstack([x, bulges]).T for x, bulges, closed in found if closed]
    pieces = [(x, bulges[: x.shape[1] - 1]) for x, bulges, closed in found if not closed]
    if pieces:
        rings += _joined(pieces, tol, path)
    return [[(x, y, b) for x, y, b in ring.tolist()] for ring in rings]


def _tolerance(found: list[Shape], path: Path) -> float:
    """Within which ends of lines meet by default.

    Raises
    ------
    MeshError
        If something lies so far from all else that it would be too much.
    """
    sizes = np.array([_size(shape) for shape in found])
    long = [x for (x, *_), size in zip(found, sizes, strict=True) if size > 0]
    if not long:
        return 0.0
    extent = float(np.ptp(np.hstack(long), axis=1).max())
    if extent > ASTRAY * sizes.max():
        middles = np.stack([x.mean(axis=1) for x in long])
        far = np.abs(middles - np.median(middles, axis=0)).max(axis=1).argmax()
        raise MeshError(
            f"expected shapes near each other in {path}, got a drawing {extent:.4g} wide of "
            f"shapes up to {sizes.max():.4g}, with one at {place(middles[far])}. Remedy: erase "
            "what lies astray, layer=, or tol= within which ends of lines meet"
        )
    return NEAR * max(extent, float(sizes.max()))


def _size(shape: Shape) -> float:
    """Extent of the corners of a shape, or the greatest rise of its arcs."""
    x, bulges, closed = shape
    sides = np.roll(x, -1, axis=1) - x
    rises = np.hypot(*sides) / 2 * np.abs(bulges)
    return float(max(np.ptp(x, axis=1).max(), rises[: None if closed else -1].max(initial=0.0)))


def unit_of_drawing(path: Path) -> str | None:
    """Symbol of the length that a drawing says it is drawn in (``$INSUNITS``), if it does; words
    for one of US survey feet and for a number that is no unit.

    Raises
    ------
    MeshError
        If it cannot be read.
    """
    from ezdxf.units import decode

    number = _drawing(path).header.get("$INSUNITS", 0)
    if number in SURVEY:
        return SURVEY[number]
    try:
        return decode(number)
    except IndexError:
        return f"no unit known, number {number}"


def _drawing(path: Path) -> Any:
    try:
        import ezdxf
    except ImportError as error:
        raise ImportError(
            "ezdxf reads drawings. Remedy: python -m pip install 'skfem-dual[plans]'"
        ) from error
    try:
        return ezdxf.readfile(path)
    except (ezdxf.DXFError, OSError, ValueError, LookupError, StopIteration) as error:
        why = str(error) or "the file ends too soon"
        raise MeshError(f"expected a DXF drawing in {path}: {why}") from error


def _is_on(entity: Any, layer: str | None) -> bool:
    """Whether an entity is on a layer, or on any."""
    if layer is None:
        return True
    return entity.dxf.is_supported("layer") and entity.dxf.layer.lower() == layer.lower()


def _is_hidden(entity: Any) -> bool:
    return bool(entity.dxf.is_supported("invisible") and entity.dxf.get("invisible", 0))


def _counts(entity: Any, layer: str | None) -> bool:
    """Whether an entity is a shape on a layer that shows."""
    return entity.dxftype() in SHAPES and _is_on(entity, layer) and not _is_hidden(entity)


def _draws_on(entity: Any, layer: str) -> bool:
    """Whether an entity is a block with something on a layer, which is not its own."""
    block = entity.block() if entity.dxftype() == "INSERT" else None
    return block is not None and any(
        _draws_on(part, layer) or _counts(part, layer) for part in block
    )


def _exploded(entities: list[Any], path: Path) -> list[Any]:
    """Entities with blocks replaced by what they consist of, which is on their layer where it is
    on none."""
    from ezdxf.math import InsertTransformationError

    found = []
    for entity in entities:
        if entity.dxftype() != "INSERT" or _is_hidden(entity):
            found.append(entity)
            continue
        try:
            parts = [part for each in entity.multi_insert() for part in each.virtual_entities()]
        except InsertTransformationError as error:
            raise MeshError(
                f"expected blocks without skewed arcs in {path}, got {entity.dxf.name!r}. Remedy: "
                "explode it"
            ) from error
        for part in parts:
            if part.dxf.layer == "0":
                part.dxf.layer = entity.dxf.layer
        found += _exploded(parts, path)
    return found


def _on_layer(entities: list[Any], layer: str | None, path: Path) -> list[Any]:
    """The shapes of the layer that are seen; others there are told."""
    hidden = Counter(
        f"hidden {e.dxftype()}"
        for e in entities
        if _is_hidden(e) and (layer is None or _is_on(e, layer) or _draws_on(e, layer))
    )
    entities = [e for e in entities if not _is_hidden(e)]
    shapes = [e for e in entities if e.dxftype() in SHAPES]
    layers = Counter(e.dxf.layer for e in shapes)
    had = ", ".join(f"{name!r} ({n} shape{'s' * (n > 1)})" for name, n in sorted(layers.items()))
    if layer is not None:
        shapes = [e for e in shapes if _is_on(e, layer)]
        entities = [e for e in entities if _is_on(e, layer) or _draws_on(e, layer)]
    elif len(layers) > 1:
        raise MeshError(
            f"expected the layer of the outline in {path}, which has {had}. Remedy: layer= with "
            "one of these names"
        )
    others = Counter(e.dxftype() for e in entities if e.dxftype() not in SHAPES)
    others += hidden
    left = ", ".join(f"{n} {kind}" for kind, n in sorted(others.items()))
    if not shapes:
        wanted = "" if layer is None else f" on the layer {layer!r}"
        raise MeshError(
            f"expected polylines, lines, arcs, circles or other curves{wanted} in {path}, got "
            f"{had or left or 'none'}. Remedy: "
            + ("layer= with one of these names" if layers else "draw the outline with them")
        )
    if others:
        warn(f"{path}: left out {left}; only lines and curves that show are read", MeshWarning)
    return shapes


def _piece(entity: Any, path: Path) -> Shape:
    """What a shape adds to the outline."""
    kind, up = entity.dxftype(), float(entity.dxf.extrusion.z)
    if missing := [name for name in NEEDED.get(kind, ()) if not entity.dxf.hasattr(name)]:
        raise MeshError(f"expected a {kind} with {missing[0]} in {path}, got one without")
    if abs(up) < 1 - TILT**2 / 2:
        raise _tilted(kind, path)
    if kind == "SPLINE":
        _plane([*entity.control_points, *entity.fit_points], kind, path)
    if kind in ("ELLIPSE", "SPLINE"):
        return arcs_of(entity)
    if kind == "LINE":
        return _plane([entity.dxf.start, entity.dxf.end], kind, path), np.zeros(2), False
    turn = 0.0
    if kind == "ARC":
        turn = (entity.dxf.end_angle - entity.dxf.start_angle) % 360
        turn = 0.0 if min(turn, 360 - turn) < WHOLE else turn
    if kind in ("CIRCLE", "ARC") and turn == 0:
        x, y, _ = entity.ocs().to_wcs(entity.dxf.center)
        r = float(entity.dxf.radius)
        return np.array([[x + r, x - r], [y, y]]), np.ones(2), True
    if kind == "ARC":
        bulge = np.sign(up) * np.tan(np.radians(turn / 4))
        ends = _plane([entity.start_point, entity.end_point], kind, path)
        if turn > 180:  # in two, or the ends of nearly a circle would not tell it from a point
            half = np.radians(entity.dxf.start_angle + turn / 2)
            r, (cx, cy, cz) = float(entity.dxf.radius), entity.dxf.center
            top = (cx + r * np.cos(half), cy + r * np.sin(half), cz)
            middle = _plane([entity.ocs().to_wcs(top)], kind, path)
            bulge = np.sign(up) * np.tan(np.radians(turn / 8))
            return np.insert(ends, [1], middle, axis=1), np.array([bulge, bulge, 0.0]), False
        return ends, np.array([bulge, 0.0]), False
    if kind == "LWPOLYLINE":
        corners = list(entity.vertices_in_wcs())
        bulges = [b for *_, b in entity.get_points("xyb")]
        closed = bool(entity.closed)
    else:
        if entity.is_poly_face_mesh or entity.is_polygon_mesh:
            raise MeshError(f"expected polylines in the plane, got a mesh in {path}")
        # smoothed ones keep the points of the frame beside those of the curve
        own = [not v.dxf.get("flags", 0) & FRAME_POINT for v in entity.vertices]
        corners = list(compress(entity.points_in_wcs(), own))
        bulges = [float(v.dxf.get("bulge", 0.0)) for v in compress(entity.vertices, own)]
        closed = bool(entity.is_closed)
    return _plane(corners, kind, path), np.sign(up) * np.array(bulges, dtype=float), closed


def _distinct(found: list[Shape], tol: float, path: Path) -> list[Shape]:
    """The shapes without those shorter than ``tol``, rings only if they are points beside the
    others, and those drawn twice, which are told."""
    # in one stroke what is drawn twice to the last digit, many times in some drawings
    alike = {(x.tobytes(), bulges.tobytes(), ring): (x, bulges, ring) for x, bulges, ring in found}
    point = min(tol, NEAR * max(_size(shape) for shape in found))
    kept = [shape for shape in alike.values() if _size(shape) > (point if shape[2] else tol)]
    if not kept:
        return found
    boxes = np.array([np.append(x.min(axis=1), x.max(axis=1)) for x, *_ in kept])
    twice: set[int] = set()
    for i, j in sorted(cKDTree(boxes).query_pairs(tol, p=np.inf)):
        if i not in twice and j not in twice and _are_one(kept[i], kept[j], tol):
            twice.add(j)
    if left := len(found) - len(kept) + len(twice):
        warn(
            f"{path}: left out {left} of the shapes, no longer than {tol:.3g} or drawn twice",
            MeshWarning,
        )
    return [shape for i, shape in enumerate(kept) if i not in twice]


def _are_one(one: Shape, other: Shape, tol: float) -> bool:
    """Whether no corner and no rise of an arc differ by more than ``tol``, if one is drawn to and
    the other fro or two rings begin elsewhere."""
    (x, bulges, closed), (y, arcs, ring) = one, other
    if closed != ring or x.shape != y.shape:
        return False
    n = x.shape[1] - 1 + closed  # sides
    half = np.hypot(*(np.roll(x, -1, axis=1) - x))[:n] / 2
    backwards = np.roll(y[:, ::-1], 1, axis=1) if closed else y[:, ::-1]
    for corners, turns in ((y, arcs[:n]), (backwards, -arcs[:n][::-1])):
        near = np.hypot(*(corners - x[:, :1])) <= tol
        for first in np.nonzero(near)[0] if closed else [0]:
            apart = np.hypot(*(np.roll(corners, -first, axis=1) - x))
            rises = half * np.abs(np.roll(turns, -first) - bulges[:n])
            if apart.max() <= tol and rises.max(initial=0.0) <= tol:
                return True
    return False


def _plane(points: list[Any], kind: str, path: Path) -> ndarray:
    """Points of a shape, which must be at one height, in the plane; shape (2, n)."""
    x = np.array([tuple(point) for point in points], dtype=float).reshape(-1, 3).T
    if len(points) and np.ptp(x[2]) > TILT * np.ptp(x[:2], axis=1).max():
        raise _tilted(kind, path, f", z from {x[2].min():g} to {x[2].max():g}")
    return x[:2]


def _tilted(kind: str, path: Path, how: str = "") -> MeshError:
    return MeshError(
        f"expected a plan in the x, y plane, got a {kind} out of it in {path}{how}. Remedy: draw "
        "the outline in the plane"
    )


def _joined(pieces: list[Piece], tol: float, path: Path) -> list[ndarray]:
    """Rings of pieces whose ends meet within ``tol``: arrays (n, 3) of x, y and bulge."""
    ends = np.stack([x[:, k] for x, _ in pieces for k in (0, -1)])  # of piece i: 2 i, 2 i + 1
    near = cKDTree(ends).query_ball_point(ends, tol)
    partner = np.full(len(ends), -1)
    for i, found in enumerate(near):
        others = [j for j in found if j != i]
        if len(others) != 1:
            raise MeshError(_broken(ends, i, others, tol, path))
        partner[i] = others[0]
    rings, left = [], set(range(len(pieces)))
    while left:
        ring, end = [], 2 * min(left)
        while end // 2 in left:
            left.remove(end // 2)
            x, bulges = pieces[end // 2]
            if end % 2:  # to and fro
                x, bulges = x[:, ::-1], -bulges[::-1]
            ring.append(np.vstack([x[:, :-1], bulges]).T)
            end = int(partner[end ^ 1])
        rings.append(np.concatenate(ring))
    return rings


def _broken(ends: ndarray, i: int, others: list[int], tol: float, path: Path) -> str:
    """Why the lines at an end make no ring."""
    where = place(ends[i])
    if others:
        return (
            f"expected lines that close to rings in {path}, got {len(others) + 1} that meet at "
            f"{where}. Remedy: leave out what is not the outline, or layer="
        )
    distance = np.hypot(*(ends - ends[i]).T)
    distance[i] = np.inf
    j = int(np.argmin(distance))
    return (
        f"expected lines that close to rings in {path}, got an end at {where}; the next one is "
        f"{distance[j]:.3g} away, at {place(ends[j])}. Remedy: close the gap, or tol= greater "
        f"than it, now {tol:.3g}"
    )
