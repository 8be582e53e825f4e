"""Output of benchmarks on pages: ``{measured} NAME`` shows ``performance/NAME.txt``."""

from pathlib import Path

from docutils import nodes
from sphinx.util.docutils import SphinxDirective


class Measured(SphinxDirective):
    """The file that ``python docs/measure.py NAME`` writes, or how to write it."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The text as it is, or a note where it is missing."""
        name = self.arguments[0]
        path = Path(self.env.srcdir) / "performance" / f"{name}.txt"
        self.env.note_dependency(str(path))
        if path.is_file():
            return [nodes.literal_block(text := path.read_text("utf-8"), text, language="text")]
        text = nodes.paragraph("", "Not measured yet: run ")
        text += nodes.literal(text=f"python docs/measure.py {name}")
        text += nodes.Text(".")
        return [nodes.note("", text)]


def setup(app) -> dict:
    """Register the directive."""
    app.add_directive("measured", Measured)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
