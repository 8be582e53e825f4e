"""A page as a Jupyter notebook: ``python docs/notebook.py docs/quickstart.md quickstart.ipynb``.

Programs become cells, what they print is left for them to print, the rest is text. Links to other
pages lead nowhere in a notebook and are taken out.
"""

import json
import re
import sys
from pathlib import Path

PARTS = re.compile(r"^```python\n(.*?)^```\n(?:\n```text\n.*?^```\n)?", re.M | re.S)
LINK = re.compile(r"(?<!!)\[([^]]*)\]\((?!https?:)[^)]*\)")


def notebook(page: str) -> dict:
    """The notebook of a page of Markdown, by the fourth format of Jupyter."""
    cells = []
    for i, text in enumerate(PARTS.split(page)):
        code = i % 2 == 1
        text = text.strip() if code else LINK.sub(r"\1", text).strip()
        cell = {
            "id": f"cell{len(cells)}",
            "cell_type": "code" if code else "markdown",
            "metadata": {},
            "source": text.splitlines(keepends=True),
        }
        if text:
            cells.append(cell | ({"execution_count": None, "outputs": []} if code else {}))
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return {
        "nbformat": 4,
        "nbformat_minor": 5,
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}},
        "cells": cells,
    }


def write_notebook(page: Path, target: Path) -> None:
    """Write the notebook of a page."""
    target.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(notebook(page.read_text(encoding="utf-8")), indent=1)
    target.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_notebook(Path(sys.argv[1]), Path(sys.argv[2]))
