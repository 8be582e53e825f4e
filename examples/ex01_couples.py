"""Figure 1: couples of dual grids in the sense of Definitions 1, 2 and 3.

On the whole plane both grids are dual to each other. On a bounded domain the 1-type dual grid
fills the domain and is not mutual; 2-type dual grids live on domains of their own, and the
extremal ones among them are mutually polar: where B is maximal for A, A is minimal for B.
"""

from dataclasses import dataclass

from gallery import fill_cells, legend_below, run, sheet

from skfem_dual import DualMesh
from skfem_dual.grids.couples import GridCouple
from skfem_dual.grids.duality import check_dual
from skfem_dual.grids.extremal import maximal_couple
from skfem_dual.grids.generate import disc, rectangle


@dataclass(frozen=True)
class Result:
    """A piece of two grids of the plane, a 1-type and an extremal couple."""

    plane: DualMesh
    one_type: DualMesh
    extremal: GridCouple

    def __str__(self) -> str:
        return "\n".join(
            f"{name}: conditions {'met' if check_dual(couple).ok else 'violated'}, {couple!r}"
            for name, couple in (
                ("Definition 2", self.one_type),
                ("Definition 4", self.extremal),
                ("Proposition 1", self.extremal.swapped()),
            )
        )


def main(n=30) -> Result:
    """Make the couples, of about n nodes."""
    return Result(
        DualMesh.from_mesh(rectangle(8.0, 8.0, size=0.9)),
        DualMesh.from_mesh(disc(n=n)),
        maximal_couple(disc(n=n)),
    )


def visualize(result: Result):
    """Cells of the 1-type; a part of grids that go on for ever; the extremal couple."""
    from skfem_dual.visuals.matplotlib import draw

    pictures = {}
    for name, grids in (
        ("one_type", result.one_type),
        ("whole_plane", result.plane),
        ("extremal", result.extremal),
    ):
        ax = pictures[name] = sheet(3.9)
        draw(grids, ax=ax, nodes=True, legend=False)
        ax.set_axis_off()
    plane = pictures["whole_plane"]
    for artist in plane.get_children():
        artist.set_clip_on(True)
        if artist.get_label() == "boundary":
            artist.remove()  # a plane has none
    plane.set(xlim=(-1.95, 1.95), ylim=(-1.4, 1.5))
    for ax in pictures.values():
        legend_below(ax)
    fill_cells(pictures["one_type"], result.one_type.polygons)
    return pictures


if __name__ == "__main__":
    run(main, visualize)
