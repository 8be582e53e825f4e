"""The ground from a TOML file, or layers from a CSV file."""

import tomllib
from pathlib import Path
from typing import Any

from ..ground.graded import GradedHalfSpace
from ..ground.layered import Layer, LayeredHalfSpace
from ..ground.substrates import HalfSpace
from ..messages import one_line, shown
from ..units import PLAIN, Units
from .guarded import require_file, text_of
from .layers import LEAST, MOST, RIGID, read_layers
from .writing import PathLike


def read_substrate(
    path: PathLike, units: Units | str = PLAIN
) -> HalfSpace | GradedHalfSpace | LayeredHalfSpace:
    """Read the ground from a TOML file, or layers from a CSV file.

    Layers from the surface down, if any, and what lies below them; ``gradient`` may be left out::

        [[layers]]
        thickness = 2.0
        young = 20e6
        poisson = 0.3
        gradient = 0.1  # E = young (1 + gradient z) from the top of the layer

        [base]
        young = 60e6
        poisson = 0.25
        gradient = 0.05

    or, for a rigid base, ``base = "bonded"`` or ``base = "smooth"`` before the layers.

    A file ending in ``.csv`` has a line of headings, layers from the surface down, and last what
    lies below them, whose thickness is left empty or ``inf``; a last line ``rigid,,`` is a rigid
    base to which the layers are bonded::

        thickness, E, nu
        2.0, 20e6, 0.3
        , 60e6, 0.25

    Columns may be named in English, German or French, with units, such as ``E [MPa]``. ``G``
    stands for ``E = 2 G (1 + nu)``; in place of the thickness there may be the ``depth`` of the
    top or of the bottom of each layer, or ``from`` and ``to``. A column ``name`` or ``soil`` does
    not count. With semicolons or tabs between the columns decimal commas are read, too.

    Parameters
    ----------
    path : path
        The file.
    units : Units or str
        To which units of headings are changed, such as ``"kN,m"``; needed if there are any.

    Returns
    -------
    HalfSpace, GradedHalfSpace or LayeredHalfSpace
        The first two without layers.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    TypeError
        If ``path`` is no path.
    ValueError
        If it is no regular file, no TOML and no CSV, has other or too few entries, entries that
        are no numbers, or values out of range.
    """
    path = require_file(path, "a TOML or CSV file")
    units = units if isinstance(units, Units) else Units(units)
    if path.suffix.lower() == ".csv":
        return _from_csv(path, units)
    text = text_of(path)
    try:
        found = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"expected TOML in {path}: {one_line(str(error), 160)}") from error
    if "base" not in found:
        had = one_line(", ".join(sorted(found)), 60) or "nothing"
        raise ValueError(
            f"expected a table [base] with young and poisson in {path}, got {had}. Remedy: a line "
            '[base] before those of the ground below all layers, or base = "bonded" as the first '
            "line of the file: after [[layers]] it is one of a layer"
        )
    _require_keys(f"the file {path}", found, {"base"}, {"layers"})
    base: Any = found["base"]
    layers = found.get("layers", [])
    if not isinstance(layers, list) or not all(isinstance(layer, dict) for layer in layers):
        raise ValueError(f"expected tables [[layers]] in {path}, got layers = {shown(layers)}")
    if isinstance(base, str):
        base = RIGID.get(base, base)
    rigid = base in ("bonded", "smooth")
    if not rigid and not isinstance(base, dict):
        raise ValueError(
            f'expected a table [base], "bonded" or "smooth" as base in {path}, got {shown(base)}'
        )
    if rigid and not layers:
        raise ValueError(f"expected layers on the base {base!r} in {path}, got none")
    made = [_layer(layer, f"layer {i + 1} of {path}") for i, layer in enumerate(layers)]
    return _on_base(made, base if rigid else _half_space(base, f"base of {path}"), path)


def _from_csv(path: Path, units: Units) -> HalfSpace | GradedHalfSpace | LayeredHalfSpace:
    layers, below = read_layers(path, units)
    made = [_layer(numbers, where) for where, numbers in layers]
    where, base = below
    return _on_base(made, base if isinstance(base, str) else _half_space(base, where), path)


def _on_base(made: list[Layer], below: Any, path: Path) -> Any:
    """Layers on a base, or the base alone."""
    if not made:
        return below
    try:
        return LayeredHalfSpace(made, below)
    except (ValueError, ArithmeticError) as error:
        raise ValueError(f"{path}: {error}") from error


def _layer(table: dict[str, Any], where: str) -> Layer:
    numbers = _numbers(table, {"thickness", "young", "poisson"}, where)
    try:
        return Layer(**numbers)
    except (ValueError, ArithmeticError) as error:
        raise ValueError(f"{where}: {error}") from error


def _half_space(table: dict[str, Any], where: str) -> HalfSpace | GradedHalfSpace:
    numbers = _numbers(table, {"young", "poisson"}, where)
    gradient = numbers.pop("gradient", 0.0)
    try:
        if gradient:
            return GradedHalfSpace.init_linear(**numbers, gradient=gradient)
        return HalfSpace(**numbers)
    except (ValueError, ArithmeticError) as error:
        raise ValueError(f"{where}: {error}") from error


def _numbers(table: dict[str, Any], needed: set[str], where: str) -> dict[str, float]:
    """The entries of a table, all of them numbers of a sensible size."""
    _require_keys(where, table, needed, {"gradient"})
    for key, value in table.items():
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not (value == 0 or LEAST <= abs(value) <= MOST):
            raise ValueError(
                f"expected a number for {key} in {where}, 0 or from {LEAST:g} to {MOST:g} in "
                f"size, got {shown(value)}"
            )
    return {key: float(value) for key, value in table.items()}


def _require_keys(where: str, found: dict, needed: set[str], optional: set[str]) -> None:
    if missing := needed - set(found):
        had = one_line(str(sorted(found)), 60)
        raise ValueError(f"expected {sorted(missing)} in {where}, got {had}")
    if unknown := set(found) - needed - optional:
        raise ValueError(
            f"expected no other entries than {sorted(needed | optional)} in {where}, got "
            f"{one_line(str(sorted(unknown)), 60)}"
        )
