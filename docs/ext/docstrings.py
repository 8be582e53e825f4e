"""Docstrings: references by short names, and properties that are described in plain words.

``DualMesh`` refers to ``skfem_dual.DualMesh``. Napoleon takes what stands before a colon in the
first line of a property for its type; here it is a sentence. Members that a page has in sections
below their class are left out of the rest of its members. The first page of the reference gets the
names of the others from them.
"""

import re
from pathlib import Path

kept: dict[str, list[str]] = {}


def keep(app, what: str, name: str, obj, options, lines: list[str]) -> None:
    """Remember plain descriptions of properties before napoleon sees them."""
    sections = any(re.fullmatch(r"-{4,}", line) for line in lines)
    if what in ("attribute", "property") and not sections:
        kept[name] = list(lines)


def restore(app, what: str, name: str, obj, options, lines: list[str]) -> None:
    """Put them back."""
    lines[:] = kept.pop(name, lines)


def sections(folder: Path) -> set[tuple[str, str]]:
    """Class and name of all members that stand in sections of the pages of a folder."""
    found = set()
    for page in folder.glob("*.md"):
        for block in page.read_text(encoding="utf-8").split(".. autoclass:: ")[1:]:
            name = block.split()[0].rpartition(".")[2]
            members = re.findall(r"^   \.\. auto(?:method|property):: (\w+)", block, re.M)
            found |= {(name, member) for member in members}
    return found


def skip(app, what: str, name: str, obj, skipped: bool, options) -> bool | None:
    """Whether a member stands in a section already."""
    where = app.env.current_document.autodoc_class
    return True if (where, name) in app.env.config.sections else None


def overview(app, docname: str, source: list[str]) -> None:
    """Put below the title of each page of the reference what it describes."""

    def summary(title: re.Match) -> str:
        page = Path(app.srcdir) / "api" / f"{title[1]}.md"
        names = re.findall(r"^\.\. auto\w+:: (\S+)", page.read_text(encoding="utf-8"), re.M)
        lines = (f"   {name.removeprefix('skfem_dual.')}" for name in names)
        head = ".. currentmodule:: skfem_dual\n\n.. autosummary::\n   :nosignatures:\n\n"
        return f"{title[0]}\n\n```{{eval-rst}}\n{head}" + "\n".join(lines) + "\n```"

    if docname == "api/index":
        source[0] = re.sub(r"^## \[.*\]\((\w+)\.md\)$", summary, source[0], flags=re.M)


def resolve(app, env, node, contnode):
    """Look names up that are unknown where they stand: as public, or in any documented module."""
    if node.get("refdomain") != "py" or node.get("reftype") != "obj":
        return None
    domain, target = env.get_domain("py"), node["reftarget"]
    found = [name for name in domain.objects if name.endswith(f".{target}")]
    public = f"skfem_dual.{target}"
    if public not in found and len(found) != 1:
        return None
    name = public if public in found else found[0]
    node["reftarget"] = name
    return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", name, node, contnode)


def setup(app) -> dict:
    """Work before and after napoleon, sort members, answer for references that are not found."""
    app.connect("autodoc-process-docstring", keep, priority=100)
    app.connect("autodoc-process-docstring", restore, priority=900)
    app.connect("autodoc-skip-member", skip)
    app.connect("missing-reference", resolve)
    app.connect("source-read", overview)
    app.add_config_value("sections", sections(Path(app.srcdir) / "api"), "env")
    return {"parallel_read_safe": True}
