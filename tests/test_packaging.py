"""What travels: one version, files named from the root, links that lead somewhere."""

import re
import tomllib
from pathlib import Path

import pytest

import skfem_dual

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_one_version():
    assert PROJECT["project"]["version"] == skfem_dual.__version__
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(r"^version: (.*)$", citation, re.M)[1] == skfem_dual.__version__


def test_source_distribution_names_files_from_the_root():
    """Without the slash a folder ``tests`` anywhere would travel, that of an environment too."""
    include = PROJECT["tool"]["hatch"]["build"]["targets"]["sdist"]["include"]
    assert {"/skfem_dual", "/tests"} <= set(include)
    for pattern in include:
        assert pattern.startswith("/"), pattern
        assert (ROOT / pattern[1:]).exists(), pattern


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_relative_links_lead_somewhere(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
        if "://" not in link:
            assert (ROOT / link).exists(), link
