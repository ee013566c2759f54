"""Sphinx: `sphinx-build -W -n docs docs/_build/html`."""

import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
# cells of the tutorial call `dust` and import the package that these pages belong to
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
os.environ["PYTHONPATH"] = os.pathsep.join(
    filter(None, [str(HERE.parent), os.environ.get("PYTHONPATH")])
)

os.environ["DUST_DOCS"] = str(HERE)

import docstrings  # noqa: E402
import generate  # noqa: E402

from dusttaichi import __version__  # noqa: E402

generate.main()

project = "dusttaichi"
author = "the dusttaichi developers"
copyright = author
version = release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx-mathjax-offline",
]
exclude_patterns = ["_build", "generated/keys_*", "generated/variables_*", "generated/*.md"]

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
# the footers of cards by their separator: the directives in its place need sphinx-design 0.8
suppress_warnings = ["mystnb.unknown_mime_type", "design.card_legacy"]
nb_execution_mode = "auto"
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_execution_timeout = 180

nitpicky = True
nitpick_ignore_regex = docstrings.ELSEWHERE
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {
    "exclude-members": "model_config, extra_keys",
    "no-value": True,
}
autodoc_class_signature = "mixed"

html_theme = "pydata_sphinx_theme"
html_title = "dusttaichi"
html_static_path = ["_static"]
html_css_files = ["dust.css"]
html_favicon = "_static/logo.svg"
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "logo": {
        "text": "dusttaichi",
        "image_light": "_static/logo.svg",
        "image_dark": "_static/logo.svg",
    },
    "header_links_before_dropdown": 8,
    "navigation_with_keys": False,
    "show_nav_level": 1,
    "show_toc_level": 2,
    "navbar_align": "left",
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "friendly",
    "pygments_dark_style": "github-dark",
}
html_sidebars = {page: [] for page in ("index", "getting_started", "tutorial", "gallery")}
copybutton_exclude = ".linenos, .gp, .go"


def setup(app):
    """Docstrings are plain text: what Sphinx would take for markup is set apart."""
    docstrings.setup(app)
