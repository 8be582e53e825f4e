"""Pieces of an HTML page: numbers, tables, figures, notices."""

import html
import re
from base64 import b64encode
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy import ndarray

from ..messages import decimals_of
from ..units import Unit


@dataclass(frozen=True)
class Picture:
    """A picture as a data URI, and its width in pixels of CSS."""

    uri: str
    width: int

    @classmethod
    def from_svg(cls, text: str, width: int) -> Self:
        """A vector graphic."""
        return cls("data:image/svg+xml;base64," + b64encode(text.encode()).decode(), width)


class Html(str):
    """Text that is markup already; all other text is escaped where it enters a page."""

    __slots__ = ()


class Number(Html):
    """A number as markup, which knows what it is: others in its column have as many decimals."""

    __slots__ = ("digits", "value")
    value: float
    digits: int

    def with_decimals(self, decimals: int) -> Html:
        """The same written with so many; nothing is 0."""
        if self.value == 0:
            return self
        text = f"{round(self.value, decimals) + 0.0:,.{decimals}f}"  # no -0
        text = text.replace(",", THIN).replace("-", "−")
        return Html(f'<data value="{self.value!r}">{text}</data>')


DASH, NONE = Html("–"), Html("")
THIN = "\N{NARROW NO-BREAK SPACE}"
#: from this exponent on numbers are written with a power of ten
LONG = 9


def escaped(text: Any) -> Html:
    """Text as markup; what cannot be in a page, such as control characters, is replaced."""
    if isinstance(text, Html):
        return text
    plain = str(text).encode("utf-8", "replace").decode()
    plain = re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]", "\N{REPLACEMENT CHARACTER}", plain)
    return Html(html.escape(plain))


def joined(parts: Iterable[Any], separator: str = "") -> Html:
    """Parts of a page, one after the other."""
    return Html(separator.join(escaped(part) for part in parts))


def number(value: float, digits: int = 5) -> Html:
    """A number for readers, with the whole of it for programs; a dash if it is not finite."""
    value = float(value)
    if not np.isfinite(value):
        return DASH
    rounded = f"{value:.{digits - 1}e}"
    mantissa, _, exponent = rounded.partition("e")
    if -4 <= int(exponent) < LONG:
        decimals = max(digits - 1 - int(exponent), 0)
        text = _trimmed(f"{float(rounded):,.{decimals}f}").replace(",", THIN)
    else:
        text = f"{_trimmed(mantissa)} × 10<sup>{int(exponent)}</sup>"
    text = text.replace("-", "−")
    found = Number(f'<data value="{value!r}">{text}</data>')
    found.value, found.digits = value, digits
    return found


def aligned(cells: Sequence[Any]) -> Sequence[Any]:
    """Cells of a column, its numbers with equally many decimals where that can be."""
    numbers = [cell for cell in cells if isinstance(cell, Number)]
    largest = max(numbers, key=lambda cell: abs(cell.value), default=None)
    if largest is None:
        return cells
    decimals = decimals_of([cell.value for cell in numbers], largest.digits)
    if decimals is None:
        return cells
    return [c.with_decimals(decimals) if isinstance(c, Number) else c for c in cells]


def alone(cell: Any) -> Html:
    """A cell as in a column of its own: its digits have nothing to do with other quantities."""
    return Html(escaped(aligned([cell])[0]))


def amount(value: float, unit: Unit, digits: int = 5) -> Html:
    """A number in a unit to read, from consistent ones."""
    return number(unit.factor * value, digits)


def symbol(unit: Unit) -> Html:
    """A unit as it is written."""
    return Html(unit.symbol.replace("^1.5", "<sup>3/2</sup>"))


def _trimmed(text: str) -> str:
    return text.rstrip("0").rstrip(".") if "." in text else text


def pair(x: Sequence[float] | ndarray, digits: int = 5) -> Html:
    """Two coordinates."""
    return Html(f"({number(x[0], digits)}, {number(x[1], digits)})")


def coordinate(value: float, size: float) -> Html:
    """A coordinate of a point of something so large: as many digits as that needs, no noise."""
    if not np.isfinite(value):
        return DASH
    if abs(value) <= 1e-9 * size:
        return number(0.0)
    return number(value, 5 + max(0, int(np.floor(np.log10(abs(value) / size)))))


def placed(x: Sequence[float] | ndarray, size: float) -> Html:
    """The point with two such coordinates."""
    return Html(f"({coordinate(x[0], size)}, {coordinate(x[1], size)})")


def percent(share: float) -> Html:
    """A share of a whole, of three digits."""
    if not np.isfinite(share):
        return DASH
    return Html(f'<span class="share">{number(100 * share, 3)} %</span>')


def one_to(slope: float, negligible: bool = False) -> Html:
    """A slope as 1 : n."""
    if negligible or slope == 0:
        return Html("level")
    return Html(f"1 : {number(1 / abs(slope), 4)}")


def table(
    rows: Iterable[Sequence[Any]],
    head: Sequence[Any] = (),
    caption: str = "",
    numeric: bool = False,
) -> Html:
    """Rows whose first cells name them; numbers of ``numeric`` ones are aligned to the right."""
    rows = [list(row) for row in rows]
    if numeric and rows:
        rows = [list(row) for row in zip(*map(aligned, zip(*rows, strict=True)), strict=True)]
    lines = [Html(f"<caption>{escaped(caption)}</caption>")] if caption else []
    if head:
        cells = joined(Html(f'<th scope="col">{escaped(cell)}</th>') for cell in head)
        lines.append(Html(f"<thead><tr>{cells}</tr></thead>"))
    lines.append(Html("<tbody>"))
    for name, *values in rows:
        cells = joined(Html(f"<td>{escaped(value)}</td>") for value in values)
        lines.append(Html(f'<tr><th scope="row">{escaped(name)}</th>{cells}</tr>'))
    lines.append(Html("</tbody>"))
    kind = ' class="numeric"' if numeric else ""
    label = escaped(caption or (head[0] if head else "table"))
    return Html(
        f'<div class="scroll" tabindex="0" role="region" aria-label="{label}">'
        f"<table{kind}>\n{joined(lines, chr(10))}\n</table></div>\n"
    )


def small(text: Any) -> Html:
    """A remark below the name of a row."""
    return Html(f"<br><small>{escaped(text)}</small>")


def paragraph(*parts: Any) -> Html:
    """Parts one after the other in a paragraph."""
    return Html(f"<p>{joined(parts)}</p>\n")


def figure(picture: Picture, alt: str, *caption: Any) -> Html:
    """A picture inside the page, with a caption."""
    return Html(
        f'<figure><img src="{picture.uri}" width="{picture.width}" alt="{escaped(alt)}">'
        f"<figcaption>{joined(caption)}</figcaption></figure>\n"
    )


def short_list(items: Iterable[tuple[str, Any]]) -> Html:
    """Names and values that one looks for first."""
    cells = joined(
        Html(f"<div><dt>{escaped(name)}</dt><dd>{escaped(value)}</dd></div>")
        for name, value in items
    )
    return Html(f'<dl class="short">{cells}</dl>\n')


def notice(kind: str, heading: Any, *parts: Any) -> Html:
    """A framed notice, a ``"fault"`` or a ``"caution"``."""
    return Html(
        f'<div class="{kind}" role="alert"><strong>{escaped(heading)}</strong>'
        f"<p>{joined(parts)}</p></div>\n"
    )


def titled(heading: str, name: str) -> str:
    """A heading with the name of what it is about, if there are several."""
    return f"{heading}, {name}" if name else heading


def section(heading: str, *parts: Any) -> Html:
    """Parts under a heading."""
    return Html(f"<section>\n<h2>{escaped(heading)}</h2>\n{joined(parts)}</section>\n")


def page(title: str, subtitle: Any, body: Html) -> str:
    """The whole page; nothing is loaded from elsewhere, and nothing can be."""
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escaped(title)}</title>
<style>{STYLE}</style>
</head>
<body>
<header>
<h1>{escaped(title)}</h1>
<p class="subtitle">{escaped(subtitle)}</p>
</header>
<main>
{body}</main>
</body>
</html>
"""


STYLE = """
:root { color-scheme: light; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; text-size-adjust: 100%; }
body {
  margin: 0 auto; max-width: 52rem; padding: 1.5rem 1.25rem 3rem;
  background: #fff; color: #1a1a1a;
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", "Liberation Sans", sans-serif;
  overflow-wrap: break-word;
}
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0; }
h2 { font-size: 1.2rem; margin: 2.2rem 0 .6rem; padding-bottom: .25rem;
  border-bottom: 2px solid #1a1a1a; }
p { margin: .6rem 0; }
small, figcaption, .subtitle { color: #555; font-size: .875em; }
.subtitle { margin: .3rem 0 1.2rem; }
/* a shadow on the side where a wide table goes on */
.scroll { overflow-x: auto; margin: .8rem 0; background:
    linear-gradient(90deg, #fff 40%, #fff0) 0 0 / 2rem 100% local no-repeat,
    linear-gradient(270deg, #fff 40%, #fff0) 100% 0 / 2rem 100% local no-repeat,
    linear-gradient(90deg, #0003, #0000) 0 0 / .7rem 100% scroll no-repeat,
    linear-gradient(270deg, #0003, #0000) 100% 0 / .7rem 100% scroll no-repeat; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .4rem 0; }
th, td { text-align: left; vertical-align: top; padding: .35rem .8rem .35rem 0;
  border-bottom: 1px solid #ddd; overflow-wrap: anywhere; }
thead th { border-bottom: 1px solid #1a1a1a; vertical-align: bottom; }
tbody th { font-weight: 400; }
table:not(.numeric) tbody th { width: 42%; min-width: 8rem; }
table:not(.numeric) td:last-child { width: 4rem; min-width: 2.6rem; padding-right: 0; }
.numeric th, .numeric td { overflow-wrap: normal; }
.numeric td, .numeric thead th:not(:first-child) { text-align: right; }
.numeric th:last-child, .numeric td:last-child { padding-right: 0; }
data, .share { white-space: nowrap; }
sup { font-size: .7em; line-height: 0; vertical-align: .45em; }
.short { display: flex; flex-wrap: wrap; gap: .8rem 2.2rem; margin: 1rem 0; padding: .9rem 1.1rem;
  background: #f4f5f6; }
.short dt { color: #555; font-size: .875rem; }
.short dd { margin: 0; font-size: 1.2rem; font-weight: 600; }
figure { margin: 1.2rem 0; text-align: center; break-inside: avoid; }
figure img { max-width: 100%; height: auto; }
figcaption { text-align: left; margin-top: .4rem; }
.caution, .fault { margin: 1rem 0; padding: .7rem 1rem; border-left: 6px solid #b87a00;
  background: #fdf4e0; break-inside: avoid; }
.fault { border: 6px solid #a3120b; background: #a3120b; color: #fff; font-size: 1.1rem; }
.fault strong { font-size: 1.5rem; }
.caution p, .fault p { margin: .2rem 0 0; }
@media (max-width: 30rem) {
  body { padding: 1rem .8rem 2rem; font-size: 15px; }
  h1 { font-size: 1.4rem; }
  th, td { padding-right: .5rem; }
  .numeric { font-size: .82rem; }
}
@media print {
  @page { margin: 18mm 16mm; }
  html { font-size: 9.5pt; }
  body { max-width: none; padding: 0; font-size: 1rem; line-height: 1.35; }
  th, td { padding-top: .2rem; padding-bottom: .2rem; }
  h2 { margin-top: 1.4rem; }
  h2 { break-after: avoid; }
  tr { break-inside: avoid; }
  caption { break-after: avoid; }
  thead { display: table-header-group; }
  .scroll { overflow: visible; background: none; }
  .short, .caution { background: none; border: 1px solid #888; }
  .fault { background: none; color: #000; border: 4px double #000; }
  figure img { max-height: 9cm; width: auto; }
}
"""
