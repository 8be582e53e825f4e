"""Heights of measured surfaces."""

from typing import Any

import numpy as np
from numpy import ndarray

from ..arguments import Pair
from ..contact.measured import MICROMETRES, checked_spacing, middles
from ..messages import listed, one_line
from ..units import LENGTHS
from .guarded import require_file, text_of
from .tables import COORDINATES, Heading, cells_of, make_numbers, parted_heads
from .writing import PathLike

#: separators between the numbers of a text that are tried: the first that is in its first line
SEPARATORS = ";", "\t", ","
#: what stands where nothing was measured
MISSING = {"na", "nan", "nil", "none", "null", "bad", "missing", "nodata", "void"}
#: what to do about texts that are no numbers, unless their reader knows
REMEDY = (
    "one decimal mark in all of it, a comma only between semicolons or tabs, and a number where "
    "nothing was measured"
)

#: units of length in metres
SIZES = {name: size for name, (size, _) in LENGTHS.items()} | {
    **dict.fromkeys(MICROMETRES, 1e-6),
    "nm": 1e-9,
}

Points = ndarray | tuple[ndarray, ndarray]


def read_heights(
    path: PathLike, spacing: float | Pair | None, origin: Pair, unit: str
) -> tuple[Points, ndarray]:
    """Points and heights of a file, as `MeasuredProfile.read` takes them."""
    file = require_file(path, "a file of heights")
    if spacing is not None:
        spacing = checked_spacing(spacing)
    kind = file.suffix.lower()
    if kind == ".npy":
        values = _array(file)
    elif kind in (".csv", ".txt"):
        values = _arranged(*_text(file), file, unit, points=spacing is None)
    else:
        values, inside = _topography(file, unit)
        spacing = spacing or inside
        if spacing is None:
            raise ValueError(f"expected spacing=(dx, dy) for {file}, which tells no sizes")
    if spacing is None:
        if values.shape[1] != 3:
            raise ValueError(
                f"expected three columns x, y and height in {file}, got {values.shape[1]}. "
                "Remedy: spacing=(dx, dy) for a grid of heights"
            )
        if any(origin):
            raise ValueError(
                f"expected origin= for a grid of heights only, got {origin} for {file}, whose "
                "columns tell places. Remedy: MeasuredProfile(x, height) of places moved"
            )
        if not len(values):
            raise ValueError(f"expected places with heights in {file}, got none")
        _require_finite(file, values)
        return values[:, :2].T, values[:, 2]
    if min(values.shape) < 2:
        raise ValueError(
            f"expected a grid of two heights or more in both directions in {file}, got shape "
            f"{values.shape}"
        )
    _require_finite(file, values)
    return middles(values.shape, spacing, origin), values


def _require_finite(file: Any, values: ndarray) -> None:
    if not np.isfinite(values).all():
        i, j = (int(k[0]) for k in np.nonzero(~np.isfinite(values)))
        raise ValueError(
            f"expected finite heights in {file}, got {values[i, j]} at index ({i}, {j}), "
            f"{np.sum(~np.isfinite(values))} in all. Remedy: fill what was not measured"
        )


def _array(file: Any) -> ndarray:
    try:
        values = np.load(file, allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise ValueError(f"expected numbers in {file}: {one_line(str(error), 160)}") from error
    if not isinstance(values, ndarray) or values.ndim != 2 or values.dtype.kind not in "iuf":
        what = f"shape {values.shape} of {values.dtype}" if isinstance(values, ndarray) else "more"
        raise ValueError(f"expected one array of numbers with two axes in {file}, got {what}")
    return values.astype(float)


def _text(file: Any) -> tuple[ndarray, list[Heading]]:
    """Numbers of a text, in columns, and their headings if a first line of words has some, or the
    last one with # before the numbers names x and y, or tells one length with its unit; what else
    begins with # is skipped."""
    text = text_of(file).replace("\N{MINUS SIGN}", "-")
    try:
        filled = {k: line for k, line in enumerate(text.splitlines(), 1) if line.strip()}
        lines = {k: line for k, line in filled.items() if line.lstrip()[0] != "#"}
        first = next(iter(lines.values()), "")
        separator = _separator(first)
        heads = _headings(first, separator)
        if _is_heading(parted_heads(first, separator)):
            lines = dict(list(lines.items())[1:])
            if len(heads) == 1:  # between which nothing stands
                separator = _separator(next(iter(lines.values()), ""))
        else:
            remarks = [line for k, line in filled.items() if lines and k < min(lines)]
            told = _headings(remarks[-1].lstrip("# \t"), separator) if remarks else []
            fits = len(told) == len(parted_heads(first, separator))
            heads = told if (fits and _names_places(told)) or _tells_length(told) else []
        if not lines:
            raise ValueError("there are none")
        if separator is not None:
            lines = _without_ends(lines, separator)
        if separator in (";", "\t") and any("," in line for line in lines.values()):
            rows = [(f"line {k}", cells_of(line, separator)) for k, line in lines.items()]
            make_numbers(rows, range(max(len(cells) for _, cells in rows)), separator)
            lines = {k: separator.join(cells) for k, (_, cells) in zip(lines, rows, strict=True)}
        try:
            return np.loadtxt(list(lines.values()), delimiter=separator, ndmin=2), heads
        except ValueError:
            _require_numbers(lines, separator)  # tells where
            raise
    except ValueError as error:
        why, _, remedy = str(error).partition(" Remedy: ")
        raise ValueError(
            f"expected numbers in columns in {file}: {one_line(why, 160).rstrip('.')}. Remedy: "
            + (remedy or REMEDY)
        ) from error


def _without_ends(lines: dict[int, str], separator: str) -> dict[int, str]:
    """Without the marks that all lines end with, as instruments write them."""
    parted = {k: line.rsplit(separator, 1) for k, line in lines.items()}
    ended = all(len(parts) == 2 and not parts[1].strip() for parts in parted.values())
    if not ended or not any(parts[0].strip() for parts in parted.values()):
        return lines
    return _without_ends({k: parts[0] for k, parts in parted.items()}, separator)


def _arranged(
    values: ndarray, heads: list[Heading], file: Any, unit: str, *, points: bool
) -> ndarray:
    """Numbers in a unit, as far as headings tell theirs; of ``points`` in the order x, y, height.

    Raises
    ------
    ValueError
        If a unit is none of length.
    """
    of_all = not points and len(heads) == 1
    if len(heads) != values.shape[1] and not of_all:
        if points and _names_places(heads):
            raise ValueError(
                f"expected a heading for each of the {values.shape[1]} columns of {file}, got "
                f"{len(heads)}: {listed([head.name for head in heads])}. Remedy: such as x [mm]"
            )
        return values
    units = {head.unit for head in heads}
    if not points and (_names_places(heads) or len(units) > 1):
        raise ValueError(
            f"expected a grid of heights in one unit in {file}, with spacing=, got columns "
            f"{listed([head.name for head in heads])}. Remedy: without spacing= for columns of "
            "places, or no headings"
        )
    for head in heads:
        if head.unit and head.unit not in SIZES:
            raise ValueError(
                f"expected a unit of length, {', '.join(SIZES)}, in the headings of {file}, got "
                f"{head.unit!r}. Remedy: no brackets around what is no unit"
            )
    values = values * [SIZES[head.unit] / SIZES[unit] if head.unit else 1.0 for head in heads]
    if points and len(heads) == 3 and _names_places(heads):
        found = [COORDINATES.get(head.name) for head in heads]
        values = values[:, [found.index(0), found.index(1), found.index(None)]]
    return values


def _headings(line: str, separator: str | None) -> list[Heading]:
    """The words of a line as headings."""
    return [Heading.of(word.strip("\"'")) for word in parted_heads(line, separator)]


def _separator(line: str) -> str | None:
    return next((mark for mark in SEPARATORS if mark in line), None)


def _tells_length(heads: list[Heading]) -> bool:
    """Whether there is one heading, with a unit of length."""
    return len(heads) == 1 and heads[0].unit in SIZES


def _names_places(heads: list[Heading]) -> bool:
    """Whether there are one of x and one of y."""
    found = [COORDINATES.get(head.name) for head in heads]
    return found.count(0) == found.count(1) == 1


def _is_heading(cells: list[str]) -> bool:
    """Whether a first line names columns: a row of which nothing was measured does not."""
    words = [word for cell in cells if (word := cell.strip().strip("\"'"))]
    named = all(word[0].isalpha() and word.casefold() not in MISSING for word in words)
    return named and len(words) > 0 and (len(words) == 1 or len(set(words)) > 1)


def _require_numbers(lines: dict[int, str], separator: str | None) -> None:
    """Refuse rows of another length than the first, and the first cell that is no number."""
    columns = len(next(iter(lines.values())).split(separator))
    for k, line in lines.items():
        cells = line.split("#")[0].split(separator)
        if len(cells) != columns:
            raise ValueError(f"line {k} has {len(cells)} columns, the first {columns}")
        for j, cell in enumerate(cells, 1):
            if not _is_number(cell):
                raise ValueError(f"got {cell.strip()!r} in line {k}, column {j}")


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _topography(file: Any, unit: str) -> tuple[ndarray, Pair | None]:
    """Heights, NaN where there are none, and their distances, in a unit if the file has one."""
    try:
        import SurfaceTopography
        from SurfaceTopography.Exceptions import CannotDetectFileFormat
    except ImportError as error:
        raise ImportError(
            f"SurfaceTopography is needed for {file}: pip install 'skfem-dual[surfaces]'. "
            "Without it .npy, .csv and .txt are read"
        ) from error
    try:
        found = SurfaceTopography.read_topography(str(file))
    except (CannotDetectFileFormat, ValueError, KeyError, OSError, EOFError) as error:
        reason = one_line(str(error), 160) or type(error).__name__
        raise ValueError(f"expected heights that can be read in {file}: {reason}") from error
    if found.dim != 2 or not found.is_uniform:
        raise ValueError(f"expected a map of heights in {file}, got a line")
    if found.unit is not None:
        found = found.to_unit(unit)
    heights: ndarray = np.ma.filled(np.ma.asarray(found.heights(), dtype=float), np.nan)
    sizes = found.physical_sizes
    if sizes is None:
        return heights, None
    return heights, (float(sizes[0]) / heights.shape[0], float(sizes[1]) / heights.shape[1])
