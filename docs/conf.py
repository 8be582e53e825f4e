"""How sphinx builds the documentation: ``python -m sphinx -W --keep-going docs docs/_build``."""

import logging
import os
import sys
from pathlib import Path

DOCS = Path(__file__).parent
EXAMPLES = DOCS.parent / "examples"
sys.path[:0] = [str(DOCS), str(DOCS / "ext"), str(EXAMPLES)]
# also for the processes that run the examples
os.environ |= {"MPLBACKEND": "agg", "PYVISTA_OFF_SCREEN": "true"}

from skfem_dual import __version__
from skfem_dual.visuals.offscreen import require_opengl

require_opengl()  # before VTK draws anything

from drawings import draw_all
from example_pages import SECTIONS, FileNames, copy_examples
from front import draw_front
from notebook import write_notebook
from themes import scrape
from validation import write_tables

logging.getLogger("skfem").setLevel(logging.WARNING)  # tells of every assembly

project = "skfem_dual"
author = "The skfem_dual developers"
project_copyright = author
version = release = __version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "docstrings",
    "example_pages",
    "mathml",
    "measured",
    "themes",
]
exclude_patterns = ["_*", "ext", "generated", "gallery/*/*.py.md5"]
default_role = "py:obj"
highlight_language = "none"  # where nothing else is said
suppress_warnings = ["config.cache"]  # sphinx-gallery's settings hold objects

myst_enable_extensions = ["attrs_block", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

autodoc_typehints = "none"  # types and shapes are in the docstrings
autodoc_member_order = "bysource"
autosummary_generate = False
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_preprocess_types = False

copy_examples(EXAMPLES, DOCS / "_examples", DOCS / "gallery")
draw_all(DOCS / "_drawings")
write_tables(DOCS / "_validation")
draw_front(DOCS / "_front", DOCS / "_scenes" / "scenes")
write_notebook(DOCS / "quickstart.md", DOCS / "_notebook" / "quickstart.ipynb")
sphinx_gallery_conf = {
    "examples_dirs": [f"_examples/{folder}" for folder in SECTIONS],
    "gallery_dirs": [f"gallery/{folder}" for folder in SECTIONS],
    "filename_pattern": r"ex\d",
    "image_scrapers": (scrape,),
    "reset_argv": FileNames(EXAMPLES),
    "within_subsection_order": "FileNameSortKey",
    "parallel": min(4, os.cpu_count() or 1),
    "notebook_extensions": set(),
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "abort_on_example_error": True,
    "remove_config_comments": True,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "thumbnail_size": (480, 360),
    "matplotlib_animations": False,
}

html_theme = "furo"
pygments_dark_style = "github-dark"
html_title = f"skfem_dual {version}"
html_static_path = ["_static"]
html_extra_path = ["_scenes"]
html_favicon = "_static/cell.svg"
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
