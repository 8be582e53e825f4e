"""The gallery's pages, made from the scripts in ``examples``.

Sphinx-gallery asks for a title in the docstring of a script and executes it without its file
name. So copies of the scripts get titles, made of the first sentences of their docstrings, and
the name of the original. On the pages pictures and tables stand above the programs.
"""

import ast
import re
import shutil
from pathlib import Path

#: a folder for each section of the gallery, its title and introduction
SECTIONS = {
    "paper": (
        "The paper, figure by figure",
        "Figures and tables of the paper, computed again: ours beside the printed ones.",
    ),
    "beyond": (
        "Beyond the paper",
        "What dual grids and rigid punches are good for otherwise.",
    ),
}
#: from this number on examples go beyond the paper
BEYOND = 20
#: keyword arguments of ``main`` for examples that would take too long
SMALLER: dict[str, dict] = {
    "ex05_dual_grids": {"n": 120},
    "ex14_effectivity": {"n": 350, "reference": 600, "repeat": 1},
    "ex27_any_outline": {"sizes": (150, 300, 600, 1200)},
    "ex28_layered_ground": {"n": 300},
    "ex29_flexible_raft": {"n": 400},
    "ex32_raft_lifting_off": {"n": 400},
    "ex35_frame_on_footings": {"girders": (0.0, 1e7, 1e8, 3e8, 1e9, 3e9, 1e10, 1e11)},
    "ex36_wind_turbine": {"n": 300},
}

CALL = "run(main, visualize)"


def section(name: str) -> str:
    """The section of the example ``exNN_name``."""
    return "paper" if int(re.match(r"ex(\d+)", name)[1]) < BEYOND else "beyond"


def copy_examples(source: Path, target: Path, gallery: Path) -> None:
    """Write the scripts with titles, in a folder for each section, in place of earlier ones.

    Pages in ``gallery`` whose examples are gone go as well.
    """
    shutil.rmtree(target, ignore_errors=True)
    for page in gallery.glob("*/ex*.*"):
        if not (source / f"{page.name.split('.')[0]}.py").exists():
            page.unlink()
    for folder, (title, text) in SECTIONS.items():
        (target / folder).mkdir(parents=True)
        header = f"{title}\n{'=' * len(title)}\n\n{text}\n"
        (target / folder / "GALLERY_HEADER.rst").write_text(header, encoding="utf-8")
    for path in sorted(source.glob("ex[0-9]*.py")):
        text = page_source(path, SMALLER.get(path.stem, {}))
        (target / section(path.stem) / path.name).write_text(text, encoding="utf-8")


def page_source(path: Path, smaller: dict) -> str:
    """A script as sphinx-gallery wants it: a titled docstring, a block of its own for the call.

    Raises
    ------
    ValueError
        If it has no docstring, or does not end with the usual call.
    """
    script = path.read_text(encoding="utf-8")
    docstring = ast.get_docstring(ast.parse(script))
    begin = 'if __name__ == "__main__":'
    if not docstring or script.count(begin) != 1 or CALL not in script:
        raise ValueError(f"expected a docstring and, at the end, {CALL} in {path.name}")
    first = ast.parse(script).body[0]
    program, call = "".join(script.splitlines(True)[first.end_lineno :]).split(begin)
    if smaller:
        options = ", ".join(f"{name}={value!r}" for name, value in smaller.items())
        call = call.replace(CALL, f"{CALL[:-1]}, {options})")
    page = titled(docstring).replace("\\", "\\\\")
    return f'"""\n{page}\n"""\n\n{program.strip()}\n\n# %%\n\n{begin}{call}'


def titled(docstring: str) -> str:
    """A plain docstring as reStructuredText whose title is its first sentence.

    Indented lines are kept as they are.
    """
    title, _, text = docstring.partition("\n\n")
    title = escaped(" ".join(title.split()).removesuffix("."))
    blocks: list[str] = []
    for block in text.split("\n\n"):
        if block.startswith(" ") and blocks and blocks[-1].endswith("::"):
            pass  # literal as it is
        elif block.startswith(" "):
            lines = ["    " + line.strip() for line in block.splitlines()]
            block = ".. code-block:: text\n\n" + "\n".join(lines)
        else:
            block = escaped(block)
        blocks.append(block)
    return "\n\n".join([f"{title}\n{'=' * len(title)}", *blocks])


def escaped(text: str) -> str:
    """Plain text in which stars, bars and underscores at ends of words mean themselves."""
    literal = re.compile(r"(``.*?``|`.*?`)", re.DOTALL)
    parts = literal.split(text)
    parts[::2] = [re.sub(r"([*|]|_\b)", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


class FileNames:
    """What sphinx-gallery calls before a script: it gets the name of its original."""

    def __init__(self, source: Path):
        self.source = source

    def __repr__(self) -> str:
        return "FileNames()"  # the same in every build, for sphinx's cache

    def __call__(self, gallery_conf: dict, script_vars: dict) -> list[str]:
        """No arguments of the command line."""
        name = Path(script_vars["src_file"]).name
        script_vars["example_globals"]["__file__"] = str(self.source / name)
        return []


def rearranged(page: str, name: str) -> str:
    """The page of an example with what it gives first, the program that gives it last.

    Notes on downloads give way to a line that tells where the program is: without the rest of
    ``examples`` it would not run.

    Raises
    ------
    ValueError
        If it does not consist of a text, a program and a call.
    """
    mark = re.compile(r"^\.\. GENERATED FROM PYTHON SOURCE LINES.*\n", re.MULTILINE)
    head, *blocks = mark.split(page)
    title, footer = "\n.. rst-class:: sphx-glr-example-title\n", "\n.. _sphx_glr_download_"
    if len(blocks) != 2 or title not in head or footer not in blocks[1]:
        raise ValueError("expected a page with text, program and call from sphinx-gallery")
    program, last = blocks
    call = re.match(r"\s*\.\. code-block:: Python\n(?:\s*\n| .*\n)*", last)
    given = last[call.end() :].split(footer)[0]
    text = (
        "\n.. rubric:: The program\n\n"
        f"``python examples/{name}.py`` runs it, ``--save DIR`` keeps its pictures.\n\n"
    )
    return "".join([title, head.split(title)[1], given, text, program, call[0]])


def setup(app) -> dict:
    """Reorder the pages of examples when sphinx reads them."""

    def reorder(app, docname: str, source: list[str]) -> None:
        if re.match(r"gallery/\w+/ex\d", docname):
            source[0] = rearranged(source[0], docname.rpartition("/")[2])

    app.connect("source-read", reorder)
    return {"parallel_read_safe": True}
