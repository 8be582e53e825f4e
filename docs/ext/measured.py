"""Output of benchmarks on pages, from the files that ``python docs/measure.py NAME`` writes.

``{measured} NAME`` shows the output as it is, below a title and a text of its own if it has them;
what was not measured is left out. ``{beside} 0.10%`` is a table of the milliseconds to an
accuracy out of ``performance/peers.txt``.
"""

from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import directives
from measure import milliseconds
from sphinx.util.docutils import SphinxDirective

PLANS = {"disc": "rigid disc", "square": "rigid square", "Hertz": "sphere"}
PACKAGES = ("ours", "bempp-cl", "NGSolve, hp", "Tamaas", "ContactMechanics")


class Measured(SphinxDirective):
    """A section with an output, or nothing."""

    required_arguments = 1
    option_spec = {"title": directives.unchanged_required}  # noqa: RUF012
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The text as it is."""
        path = Path(self.env.srcdir) / "performance" / f"{self.arguments[0]}.txt"
        self.env.note_dependency(str(path))
        if not path.is_file():
            return []
        found = self.parse_content_to_nodes()
        found.append(nodes.literal_block(text := path.read_text("utf-8"), text, language="text"))
        if title := self.options.get("title"):
            place = nodes.make_id(title)
            found = [nodes.section("", nodes.title(title, title), *found, ids=[place])]
        return found


class Beside(SphinxDirective):
    """A table of the packages, a row for each."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Written as Markdown."""
        path = Path(self.env.srcdir) / "performance" / "peers.txt"
        self.env.note_dependency(str(path))
        found = milliseconds(path.read_text("utf-8"), self.arguments[0])
        rows = [
            ["ms to " + self.arguments[0].replace("0%", " %"), *PLANS.values()],
            ["---", *("--:" for _ in PLANS)],
            *([name, *(found.get((name, plan), "–") for plan in PLANS)] for name in PACKAGES),
        ]
        return self.parse_text_to_nodes("\n".join(f"| {' | '.join(row)} |" for row in rows))


def setup(app) -> dict:
    """Register the directives."""
    app.add_directive("measured", Measured)
    app.add_directive("beside", Beside)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
