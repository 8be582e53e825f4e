"""Formulas as MathML: pages need no scripts and nothing from elsewhere."""

import re

from docutils.nodes import SkipNode
from latex2mathml.converter import convert


def mathml(formula: str, display: str) -> str:
    """A formula of LaTeX as MathML.

    Raises
    ------
    ValueError
        If the converter does not know a part of it and leaves a bare ampersand.
    """
    found = convert(formula, display=display)
    if re.search(r"&(?!#?\w+;)", found):
        raise ValueError(f"expected a formula that can be shown as MathML, got {formula}")
    return found


def inline(translator, node) -> None:
    """A formula in a line."""
    translator.body.append(mathml(node.astext(), "inline"))
    raise SkipNode  # its source is not shown


def display(translator, node) -> None:
    """A formula of its own."""
    translator.body.append(f'<div class="math">{mathml(node.astext(), "block")}</div>')
    raise SkipNode


def setup(app) -> dict:
    """Register the renderer ``mathml``."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
