"""Plans from files."""

import json
import re
from itertools import permutations
from pathlib import Path
from typing import Any

from ..arguments import checked_size, checked_text
from ..errors import MeshError
from ..io.guarded import require_file, text_of
from ..io.writing import PathLike
from ..messages import one_line, place
from .corners import ring_of
from .drawings import rings_of_drawing
from .plan import Plan
from .tables import Corner, rings_of_table

#: names of files by what they hold
SUFFIXES = {
    ".csv": "csv",
    ".txt": "csv",
    ".wkt": "wkt",
    ".geojson": "geojson",
    ".json": "geojson",
    ".dxf": "dxf",
}
#: names of coordinate systems in degrees: numbers of those in use in the EPSG register, and one
DEGREES = re.compile(
    "(CRS84|EPSG:([^:]*:)?(4326|4258|4269|4979|4937|4267|4230|4231|4277|4289|4313|4314|4312|4171|4181"
    "|4149|4150|4275|4265|4283|7844|4167|4322|4612|6668|4490|4610|4214|4617|6318|4674|4618|4148"
    "|4152|4202|4203|4284|4301|4619|4740|9000))$"
)


def read_plan(path: PathLike, *, layer: str | None = None, tol: float | None = None) -> Plan:
    """Read the outline of a footing.

    Rings may come in any order and sense: what lies in an odd number of others is a hole. Of
    polygons in WKT and GeoJSON inner rings are, and no polygon lies inside another.

    Parameters
    ----------
    path : path
        By its name CSV (``.csv``, ``.txt``), WKT (``.wkt``), GeoJSON (``.geojson``, ``.json``) or
        DXF (``.dxf``). CSV has a corner on each line, ``x, y`` or ``x, y, bulge``, with or without
        a header, separated by commas, semicolons (then with decimal commas, too), tabs or blanks,
        and an empty line between rings. WKT and GeoJSON have polygons and multipolygons. DXF has
        closed polylines with bulges, circles, ellipses, splines, and open ones, lines and arcs
        that join; what blocks hold if nothing else is drawn.
    layer : str, optional
        The layer of a drawing; needed if it has shapes on several.
    tol : float, optional
        Distance within which ends of lines and arcs of a drawing join, by default 1e-6 of its
        extent, if that is no more than 1e4 times that of its largest shape.

    Returns
    -------
    Plan
        In the units of the file; `Plan.scaled` changes them.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    TypeError, ValueError
        If an argument is wrong, or a folder.
    ImportError
        If shapely (WKT, GeoJSON) or ezdxf (DXF) is missing: the extra ``plans`` has both.
    MeshError
        If the file cannot be read, has no outline, or one that is not closed, crosses itself or
        overlaps another; it tells where.

    Warns
    -----
    MeshWarning
        If a drawing has something else on the layer.
    """
    path = require_file(path, "an outline")
    kind = SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise MeshError(
            f"expected an outline in a file ending in {', '.join(SUFFIXES)}, got {path}. Remedy: "
            "name it by its format, or read_mesh for meshes"
        )
    if kind != "dxf" and (layer is not None or tol is not None):
        raise ValueError(f"expected layer and tol for DXF drawings only, got {path}")
    if kind == "dxf":
        layer = None if layer is None else checked_text("layer", layer)
        tol = None if tol is None else checked_size("tol", tol)
        rings = rings_of_drawing(path, layer, tol)
    else:
        text = _text(path)
        rings = rings_of_table(text, path) if kind == "csv" else _rings_of_shapes(kind, text, path)
    try:
        made = [
            ring_of(f"ring {i}", [corner[:2] for corner in ring], [corner[2] for corner in ring])
            for i, ring in enumerate(rings)
        ]
        return Plan.from_rings(made)
    except ValueError as error:
        raise MeshError(f"{path}: {error}") from error


def _text(path: Path) -> str:
    try:
        return text_of(path)
    except ValueError as error:
        raise MeshError(str(error)) from error


def _rings_of_shapes(kind: str, text: str, path: Path) -> list[list[Corner]]:
    """Rings of the polygons in WKT or GeoJSON."""
    try:
        import shapely
    except ImportError as error:
        raise ImportError(
            "shapely reads WKT and GeoJSON. Remedy: python -m pip install 'skfem-dual[plans]', "
            "or give the corners as CSV"
        ) from error
    try:
        if kind == "geojson":
            text = _with_geometry(text)
        found = shapely.from_wkt(text) if kind == "wkt" else shapely.from_geojson(text)
    except (shapely.errors.ShapelyError, ValueError, NotImplementedError) as error:
        said = re.sub(r"\w+: Error parsing JSON: |\[json\.exception\S*\] ", "", str(error))
        name, told = {"wkt": "WKT", "geojson": "GeoJSON"}[kind], one_line(said, 160)
        closed = ". Remedy: end each ring with its first point, in all digits"
        raise MeshError(
            f"expected {name} in {path}: {told}{closed if 'closed' in told else ''}"
        ) from error
    if kind == "geojson":
        _require_lengths(text, path)
    polygons = [found]
    while any(hasattr(p, "geoms") for p in polygons):  # collections of collections
        polygons = list(shapely.get_parts(polygons))
    polygons = [p for p in polygons if not p.is_empty]
    others = sorted({p.geom_type for p in polygons} - {"Polygon"})
    if others or not polygons:
        raise MeshError(
            f"expected polygons in {path}, got {', '.join(others) or 'none'}. Remedy: closed "
            "areas, POLYGON or MULTIPOLYGON"
        )
    for polygon in polygons:
        outline = shapely.Polygon(polygon.exterior)
        if outside := [ring for ring in polygon.interiors if not outline.intersects(ring)]:
            raise MeshError(
                f"expected holes inside their outline in {path}, got one at "
                f"{place(outside[0].coords[0])} outside. Remedy: correct its corners, or make it "
                "a polygon of its own"
            )
        holes = [hole for hole in map(shapely.Polygon, polygon.interiors) if hole.is_valid]
        for hole, inner in permutations(holes, 2):
            if hole.contains(inner) and not inner.contains(hole):
                raise MeshError(
                    f"expected holes beside each other in {path}, got one at "
                    f"{place(inner.exterior.coords[0])} inside another. Remedy: leave it out, or "
                    "make what bears in there a polygon of its own"
                )
    # which rings are holes these files tell; those that cross are refused with the place
    sound = [(i, p) for i, p in enumerate(polygons) if p.is_valid]
    for (i, polygon), (j, other) in permutations(sound, 2):
        if polygon.contains(other) and not other.contains(polygon):
            raise MeshError(
                f"expected polygons apart in {path}, got polygon {j} at "
                f"{place(other.exterior.coords[0])} inside polygon {i}. Remedy: leave it out, or "
                f"make it a hole, an inner ring of polygon {i}"
            )
    return [
        [(float(c[0]), float(c[1]), 0.0) for c in ring.coords]
        for polygon in polygons
        for ring in (polygon.exterior, *polygon.interiors)
    ]


def _with_geometry(text: str) -> str:
    """GeoJSON without the features that have no place, as RFC 7946 allows.

    Raises
    ------
    ValueError
        If it is no JSON, or no GeoJSON.
    """
    try:
        found: Any = json.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(found, dict) or "type" not in found:
        raise ValueError("an object with a type, such as FeatureCollection, is missing")
    features = found.get("features")
    if isinstance(features, list):
        found["features"] = [
            f for f in features if not (isinstance(f, dict) and f.get("geometry", f) is None)
        ]
    elif found["type"] == "Feature" and found.get("geometry", found) is None:
        found = {"type": "FeatureCollection", "features": []}
    return json.dumps(found)


def _require_lengths(text: str, path: Path) -> None:
    """Refuse coordinates that are said to be degrees."""
    name: Any = json.loads(text)
    for key in ("crs", "properties", "name"):
        name = name.get(key) if isinstance(name, dict) else None
    name = str(name)
    if DEGREES.search(name):
        raise MeshError(
            f"expected coordinates as lengths in {path}, got degrees ({name}). Remedy: write it "
            "in a projected system, as of your site"
        )
