"""How a footing slides and twists under horizontal loads, as a section of a report."""

from .footing import Footing
from .page import NONE, Html, Picture, amount, figure, joined, paragraph, section, table

SIGNS = """<svg xmlns="http://www.w3.org/2000/svg" width="280" height="105" viewBox="75 0 280 105">
<path d="M90 35H210V95H90Z" fill="#ddd" stroke="#1a1a1a"/>
<g fill="none" stroke="#1a1a1a"><path d="M150 65H250m-7 -4l7 4l-7 4M150 65V12m-4 7l4 -7l4 7"
stroke-width="1.5"/><path d="M176 72A27 27 0 0 0 158 39m9 -1l-9 1l6 7" stroke-width="1.5"/></g>
<g font-family="sans-serif" font-size="13" fill="#1a1a1a"><text x="256" y="69">Hx, Ux, x</text>
<text x="157" y="18">Hy, Uy, y</text><text x="180" y="58">T</text></g></svg>"""


def sliding_section(footing: Footing) -> Html:
    """Displacement and twist in the cases that have horizontal loads; nothing without any."""
    cases, units = footing.cases, footing.details.units
    sink, slope = units.displacement, units.slope
    rows = [
        (
            name,
            *(amount(h, units.force) for h in load.shear[:2]),
            amount(load.shear[2], units.moment),
            *(amount(u, sink) for u in moved[:2]),
            amount(moved[2], slope),
        )
        for name, load, moved in zip(cases.names, cases.loads, cases.sliding.T, strict=True)
        if load.shear is not None
    ]
    if not rows:
        return NONE
    head = ["Case", *(f"H{axis} [{units.force.symbol}]" for axis in "xy")]
    head += [f"T [{units.moment.symbol}]", *(f"U{axis} [{sink.symbol}]" for axis in "xy")]
    picture = Picture.from_svg(SIGNS, 280)
    return section(
        joined(["Sliding and twisting", f" {footing.name}".rstrip()]),
        table(rows, [*head, f"twist [{slope.symbol}]"], numeric=True),
        paragraph(
            "Elastic displacements of the origin in the plane of the base, and rotations about "
            "the vertical. Cells in contact carry horizontal loads without slip; sliding where "
            "friction will not do is to be checked apart from this. Horizontal forces above the "
            "base bring moments, which are among the loads only where they are given."
        ),
        figure(picture, "Signs of horizontal loads", "Positive directions, from above."),
    )
