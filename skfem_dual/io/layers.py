"""Layers of the ground from tables as geotechnical reports have them."""

from contextlib import suppress
from itertools import pairwise
from math import isclose
from pathlib import Path
from typing import Any, NamedTuple

from ..messages import apart, one_line
from ..units import Units
from .tables import Heading, cell_number, read_table, unit_factor, written_number

#: numbers are zero or between these in size, in any sensible units
LEAST, MOST = 1e-30, 1e30
#: what depths in different units may differ by
ROUNDING = 1e-9
#: what columns are called, in lower case
CALLED = {
    "thickness": ("thickness", "layer thickness", "h", "dicke", "schichtdicke", "mächtigkeit",
                  "épaisseur", "epaisseur"),
    "depth": ("depth", "z", "tiefe", "profondeur"),
    "top": ("top", "from", "depth from", "von", "tiefe von", "ok", "oberkante", "de"),
    "bottom": ("bottom", "to", "depth to", "bis", "tiefe bis", "uk", "unterkante", "à"),
    "young": ("e", "young", "young's modulus", "youngs modulus", "elastic modulus", "e-modul",
              "elastizitätsmodul", "module d'young"),
    "shear": ("g", "shear modulus", "schubmodul", "module de cisaillement"),
    "poisson": ("nu", "ν", "poisson", "poisson's ratio", "poissons ratio", "querdehnzahl",
                "poissonzahl", "coefficient de poisson"),
    # and weights and strengths, of which elastic ground takes none
    "text": ("name", "soil", "layer", "description", "no", "no.", "nr", "nr.", "boden", "bodenart",
             "schicht", "sol", "couche", "remark", "remarks", "bemerkung", "bemerkungen",
             "gamma", "γ", "unit weight", "wichte", "phi", "phi'", "φ", "φ'", "friction angle",
             "reibungswinkel", "c", "c'", "cohesion", "kohäsion"),
}  # fmt: skip
#: the modulus under lateral strain nought, and what may be either
OEDOMETRIC = ("es", "e_s", "eoed", "e_oed", "steifemodul", "constrained modulus")
#: what the thickness of the lowest layer may be
OPEN = ("", "-", "–", "inf", "∞", "infinite", "unendlich", "infini")
RIGID = {"rigid": "bonded", "starr": "bonded", "rigide": "bonded"} | {
    word: word for word in ("bonded", "smooth")
}
#: what columns with units measure
QUANTITY = {
    **dict.fromkeys(("thickness", "depth", "top", "bottom"), "length"),
    **dict.fromkeys(("young", "shear"), "pressure"),
}
#: as they are called in messages
SHOWN = {"young": "E", "shear": "G", "poisson": "nu"}
#: columns that may tell where layers are
PLACES = ({"thickness"}, {"depth"}, {"top"}, {"bottom"}, {"top", "bottom"})

Row = tuple[str, dict[str, float]]
#: where a row of a table is, and its cells
Cells = tuple[str, list[str]]


def read_layers(path: Path, units: Units) -> tuple[list[Row], tuple[str, Any]]:
    """Thickness, young and poisson of each layer, and what lies below: its moduli or a word.

    With each the line it is from.

    Raises
    ------
    ValueError
        If a heading or number is not known, or layers are not told without doubt; says in
        which line.
    """
    top, heads, rows = read_table(path, CALLED["text"])
    columns = _columns(heads, top)
    factors = {
        i: unit_factor(heads[i], QUANTITY.get(kind, ""), units, top) for kind, i in columns.items()
    }
    if "depth" in columns:  # of the tops, if it begins at the surface
        i = columns.pop("depth")
        columns["top" if _is_zero(rows[0][1][i]) else "bottom"] = i
    numbers = _Numbers(columns, factors)
    below = _below(numbers, rows)
    layers = [
        (row[0], {"thickness": high, **numbers.moduli(row)})
        for row, high in zip(rows[:-1], _thicknesses(numbers, rows), strict=True)
    ]
    return layers, (rows[-1][0], below)


def _is_zero(text: str) -> bool:
    with suppress(ValueError):
        return written_number(text) == 0
    return False


class _Numbers(NamedTuple):
    """In which columns numbers are, by what they measure, and what they are multiplied by."""

    at: dict[str, int]
    factors: dict[int, float]

    @property
    def ends(self) -> str:
        """What tells where a layer ends."""
        return "thickness" if "thickness" in self.at else "bottom"

    def of(self, row: Cells, kind: str) -> float:
        """The number of a row in the column of a kind."""
        (where, cells), i = row, self.at[kind]
        return self.factors[i] * cell_number(cells[i], SHOWN.get(kind, kind), where, LEAST, MOST)

    def moduli(self, row: Cells) -> dict[str, float]:
        """Young's modulus and Poisson's ratio."""
        poisson = self.of(row, "poisson")
        if "young" in self.at:
            return {"young": self.of(row, "young"), "poisson": poisson}
        return {"young": 2 * self.of(row, "shear") * (1 + poisson), "poisson": poisson}


def _below(numbers: _Numbers, rows: list[Cells]) -> Any:
    """What lies below the layers by the last row: its moduli, or the word for a rigid base."""
    columns, ends = numbers.at, numbers.ends
    *above, (last, cells) = rows
    words = {columns[kind]: cells[columns[kind]].lower() for kind in columns}
    known = [w for i, w in words.items() if w not in (*OPEN, *RIGID) and i != columns.get("top")]
    # without moduli its name may be the word
    said = [*words.values(), *(() if known else map(str.lower, cells))]
    base = next((RIGID[word] for word in said if word in RIGID), None)
    if base and not above:
        raise ValueError(f"{last}: expected layers on the {base} base, got none")
    if base and known:
        raise ValueError(
            f"{last}: expected a rigid base, without thickness and moduli, got {known[0]} as "
            "well. Remedy: leave that empty, or leave out the word for a half-space below"
        )
    if base:
        return base
    none = [SHOWN[k] for k in SHOWN if k in columns and not cells[columns[k]]]
    if none:
        raise ValueError(
            f"{last}: expected {' and '.join(none)} of what lies below the layers, got none. "
            "Remedy: its moduli, or the word rigid and empty cells"
        )
    moduli = numbers.moduli(rows[-1])
    if ends in columns and cells[columns[ends]].lower() not in OPEN:
        raise ValueError(
            f"{last}: expected what lies below the layers, got one more. Remedy: a last line "
            "without thickness, or the word rigid and empty cells"
        )
    return moduli


def _thicknesses(numbers: _Numbers, rows: list[Cells]) -> list[float]:
    """Of all rows but the last, each of which begins where the one above ends."""
    columns, ends, above = numbers.at, numbers.ends, rows[:-1]
    if ends == "thickness":
        return [numbers.of(row, ends) for row in above]
    tops = [numbers.of(row, "top") for row in rows] if "top" in columns else [0.0]
    bottoms = [numbers.of(row, "bottom") for row in above] if ends in columns else tops[1:]
    depths = [0.0, *bottoms]
    for (where, _), depth, given in zip(rows, depths, tops, strict=False):
        if not isclose(depth, given, rel_tol=ROUNDING):
            first, found = apart(depth, given)
            raise ValueError(
                f"{where}: expected a layer from {first} on, where the one above ends or the "
                f"base of the footing is, got one from {found}"
            )
    return [b - a for a, b in pairwise(depths)]


def _columns(heads: list[Heading], where: str) -> dict[str, int]:
    """Numbers of the columns that count, by what they are."""
    columns: dict[str, int] = {}
    kinds = {word: kind for kind, words in CALLED.items() for word in words}
    wanted = "thickness, E, nu"
    for head, _ in heads:
        if head in OEDOMETRIC:
            raise ValueError(
                f"{where}: expected Young's modulus E, got {head}, which may be the modulus of "
                "oedometers. Remedy: E = Es (1 + nu) (1 - 2 nu) / (1 - nu), under the heading E"
            )
    for i, (head, _) in enumerate(heads):
        if (kind := kinds.get(head)) is None:
            had = one_line(", ".join(head.name for head in heads), 60)
            raise ValueError(
                f"{where}: expected the headings {wanted}, or G for E, depth or from and to for "
                f"thickness, got {had}. Remedy: name the column {one_line(head, 40)!r} by one of "
                "these, or leave it out"
            )
        if kind in columns:
            raise ValueError(f"{where}: expected one column of {kind}, got {head} as well")
        if kind != "text":
            columns[kind] = i
    places = set(columns) - {"young", "shear", "poisson"}
    if (
        places not in PLACES
        or "poisson" not in columns
        or ("young" in columns) == ("shear" in columns)
    ):
        got = one_line(", ".join(head.name for head in heads), 60)
        raise ValueError(
            f"{where}: expected the headings {wanted}, one of E and G, one of thickness, depth, "
            f"or from and to, got {got}"
        )
    return columns
