"""Settings of the documents: ``python -m sphinx -W -b html data/documents OUT`` builds them, without a network.

Pages and pictures that say what the program says of itself are made before Sphinx reads the sources (`pagemaker`).
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import pagemaker

import catalogue

project = "mechanism-catalogue"
author = "The mechanism-catalogue authors"
copyright = author
version = release = catalogue.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc"]
exclude_patterns = ["README.md"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3

smartquotes = False  # which makes dashes of the hyphens of options
default_role = "py:obj"
autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_show_class_members = False
add_module_names = False

html_theme = "furo"
html_title = "Guide mechanisms"
html_show_sphinx = False
html_static_path = ["static"]
html_css_files = ["page.css"]
html_copy_source = False
templates_path = []


def setup(app):
    app.connect("builder-inited", lambda app: pagemaker.write(Path(app.srcdir) / "made"))
