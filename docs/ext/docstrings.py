"""Docstrings: references by short names, and properties that are described in plain words.

``DualMesh`` refers to ``skfem_dual.DualMesh``. Napoleon takes what stands before a colon in the
first line of a property for its type; here it is a sentence.
"""

import re

kept: dict[str, list[str]] = {}


def keep(app, what: str, name: str, obj, options, lines: list[str]) -> None:
    """Remember plain descriptions of properties before napoleon sees them."""
    sections = any(re.fullmatch(r"-{4,}", line) for line in lines)
    if what in ("attribute", "property") and not sections:
        kept[name] = list(lines)


def restore(app, what: str, name: str, obj, options, lines: list[str]) -> None:
    """Put them back."""
    lines[:] = kept.pop(name, lines)


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
    """Work before and after napoleon; answer for references that sphinx does not find."""
    app.connect("autodoc-process-docstring", keep, priority=100)
    app.connect("autodoc-process-docstring", restore, priority=900)
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True}
