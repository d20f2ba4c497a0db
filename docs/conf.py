"""How Sphinx makes the documentation: `make docs`. The gallery is `examples/`, run while the pages are made."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
# `gallery_pictures` and `typeset` lie here, and the package in the checkout.
sys.path[:0] = [str(HERE), str(HERE.parent / "python")]

import api_members  # noqa: E402
import gallery_pictures  # noqa: E402
import inventories  # noqa: E402
import matplotlib as mpl  # noqa: E402
from docutils import nodes  # noqa: E402
from pygments.lexers import TextLexer  # noqa: E402
from sphinx import addnodes  # noqa: E402

import symspline  # noqa: E402

mpl.use("agg")


project = "symspline"
author = "The symspline developers"
copyright = "2026, The symspline developers"
release = version = symspline.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "typeset",
]
exclude_patterns = ["gallery/*.ipynb", "gallery/*.py"]
# `make wasm` puts the figures of the page "Drag the points" there. Without them the site has no such page.
PLAY = (HERE / "_static/play/play.js").exists()
if PLAY:
    tags.add("play")  # type: ignore[name-defined]  # noqa: F821
else:
    exclude_patterns.append("play.md")
templates_path = ["_templates"]

# ---- pages ----

html_math_renderer = "katex"
# Primes of formulas in plain text, such as γ', are not apostrophes.
smartquotes = False
myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "dollarmath"]
# Links to headings.
myst_heading_anchors = 3
suppress_warnings: list[str] = []
nitpicky = True
# What an exception carries, in docstrings of the compiled module.
nitpick_ignore = [("py:obj", "spline")]
# Other projects' names cannot be looked up without a network, and types of arrays stand for what they take.
nitpick_ignore_regex = [
    ("py:class", r"ndarray|shape|array_like|optional|value|str to float|bool|max_speed|\d+|[A-Za-z]|\*\w+"),
    ("py:obj", "transvection"),
    (
        "py:.*",
        r"(numpy|np|scipy|jax|torch|pandas|pd|matplotlib|qutip|qt|nibabel|collections|pathlib|typing)\..*",
    ),
]
default_role = "autolink"

# ---- reference ----

autosummary_generate = True
autosummary_ignore_module_all = False
# Public modules list their names in `__all__` and hide it from `dir`, by which Sphinx would look for it.
autosummary_imported_members = True
# A space's own page has what is its own; what all share stands on the page of `Space`.
autosummary_context = {
    "spaces": [name for name in symspline.__all__ if api_members.is_space(getattr(symspline, name))],
    "groups": api_members.all_grouped(),
    # Of what a module shares with the package, whose page is that of the package.
    "shared": {
        "symspline.manifolds": [name for name in symspline.manifolds.__all__ if name in symspline.__all__],
    },
}
# Types stand in the sections Parameters and Returns.
autodoc_typehints = "none"
# It is described without being installed: it is large, and nothing on these pages runs it.
autodoc_mock_imports = ["torch"]
napoleon_google_docstring = True
napoleon_numpy_docstring = True
napoleon_use_rtype = False
# Types are words such as array_like, not classes to link to.
napoleon_use_param = False
napoleon_use_ivar = True
napoleon_attr_annotations = False
maximum_signature_line_length = 90
add_module_names = False
toc_object_entries_show_parents = "hide"

# Short inventories of other projects, which lie here, so that their names link without a network.
intersphinx_mapping = {
    name: (url, f"inventories/{name}.inv") for name, (url, _) in inventories.PROJECTS.items()
}

# ---- gallery ----

sphinx_gallery_conf = {
    # SYMSPLINE_GALLERY=0 builds the pages without running the examples, whose pictures are then missing.
    "plot_gallery": os.environ.get("SYMSPLINE_GALLERY", "1") != "0",
    "examples_dirs": ["../examples"],
    "gallery_dirs": ["gallery"],
    "copyfile_regex": r"index\.rst",
    "filename_pattern": r"\.py$",
    # The demonstration is a program of several files.
    "ignore_pattern": r"(demo|maps|tracks|hurdat)\.py$",
    "minigallery_sort_order": "gallery_pictures.place",
    "image_scrapers": ("gallery_pictures",),
    "reset_modules": ("gallery_pictures.use_style",),
    "backreferences_dir": "api/backreferences",
    "doc_module": ("symspline",),
    "reference_url": {"symspline": None},
    "inspect_global_variables": True,
    "remove_config_comments": True,
    "thumbnail_size": (480, 320),
    "show_memory": False,
    # What a last line returns is not shown, as axes and legends would be.
    "capture_repr": (),
    "show_signature": False,
    "write_computation_times": False,
    "download_all_examples": False,
    # As many examples at once as Sphinx has processes.
    "parallel": True,
}

# ---- looks ----

html_theme = "pydata_sphinx_theme"
html_title = f"symspline {release}"
html_static_path = ["_static"]
html_css_files = ["symspline.css"]
html_js_files = ["members.js"]
html_logo = "_static/logo.svg"
html_favicon = "_static/favicon.svg"
# These have nothing beside them.
html_sidebars: dict[str, list[str]] = {"index": [], "start": [], "play": []}
html_copy_source = html_show_sourcelink = False
html_theme_options = {
    "show_prev_next": False,
    "navigation_with_keys": False,
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "primary_sidebar_end": [],
    # With a contrast that everybody can read.
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_context = {"default_mode": "auto"}

# ---- what docstrings and pages have that Sphinx would misread ----


# A character of the private use area, while Napoleon works.
COLON = "\ue000"


def _escape(app: Any, what: str, name: str, thing: object, options: Any, lines: list[str]) -> None:
    """Norms |v| and shapes (..., *point_shape) are not markup, and each docstring numbers its own references."""
    label = re.sub(r"\W+", "-", name.lower())
    math = False
    for i, line in enumerate(lines):
        math = line.startswith(".. math::") or (math and line.startswith(" "))
        if math or line.startswith((">>>", "...", "    >>>", "    ...")):
            continue
        line = re.sub(
            r"\[(\d+)\](?=_\W|_$)|(?<=^\.\. )\[(\d+)\]",
            lambda found: f"[#{label}-{found[1] or found[2]}]",
            line,
        )
        parts = re.split(r"(``.*?``|:math:`.*?`)", line)
        parts[::2] = (re.sub(r"\||(?<=[( ])\*(?=\w[\w.]*[),])", r"\\\g<0>", part) for part in parts[::2])
        lines[i] = "".join(parts)
    if what in ("property", "attribute", "data"):
        # Napoleon would read a first line "Metres: …" as a type.
        lines[0] = lines[0].replace(":", COLON)


def _restore(app: Any, what: str, name: str, thing: object, options: Any, lines: list[str]) -> None:
    # Napoleon separates types from descriptions by two hyphens.
    lines[:] = [line.replace(COLON, ":").replace(" -- ", " – ") for line in lines]


# Names in the types of parameters and results that link to a page.
TYPES = {
    **{name: ("py", "class", f"symspline.{name}") for name in symspline.__all__ if name[0].isupper()},
    **inventories.TYPES,
}
TYPE = re.compile(
    rf"(?<![\w.])({'|'.join(map(re.escape, sorted(TYPES, key=len, reverse=True)))})(?![\w.]*\w)"
)


def _link_types(app: Any, doctree: nodes.document) -> None:
    """Link the names in types, which Napoleon writes in italics."""
    for field in doctree.findall(nodes.field_body):
        for shown in list(field.findall(nodes.emphasis)):
            parts = TYPE.split(shown.astext())
            if len(parts) == 1 or isinstance(shown.parent, addnodes.pending_xref):
                continue
            new: list[nodes.Node] = []
            for text, name in zip(parts[::2], [*parts[1::2], ""], strict=True):
                new += [nodes.emphasis(text, text)] if text else []
                if name:
                    domain, kind, target = TYPES[name]
                    link = addnodes.pending_xref(
                        "",
                        nodes.emphasis(name, name),
                        refdomain=domain,
                        reftype=kind,
                        reftarget=target,
                        refexplicit=True,
                    )
                    new.append(link)
            shown.parent.replace(shown, new)


def _cards(app: Any, doctree: nodes.document) -> None:
    """On a telephone, a row of a wide table of words becomes a list; tables of numbers scroll."""
    for table in doctree.findall(nodes.table):
        cells = [cell.astext() for body in table.findall(nodes.tbody) for cell in body.findall(nodes.entry)]
        if table[0]["cols"] > 3 and sum(map(len, cells)) > 15 * len(cells):
            table["classes"].append("cards")


def _public(app: Any, env: Any, node: Any, contnode: nodes.Node) -> nodes.Node | None:
    """`CubicSpline` is ``symspline.CubicSpline``, in the docstrings of every module."""
    if node.get("refdomain") != "py" or node["reftarget"].startswith("symspline."):
        return None
    target = f"symspline.{node['reftarget']}"
    domain = env.get_domain("py")
    if not domain.find_obj(env, None, None, target, None):
        return None
    return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", target, node, contnode)


def _links(app: Any, docname: str, source: list[str]) -> None:
    """On the site a page outside `docs` is the page that includes it, and there may be no page to play."""
    source[0] = source[0].replace("](../benchmarks/README.md)", "](benchmarks.md)")
    if not PLAY:
        source[0] = re.sub(r"^:::\{only\} play\n.*?^:::\n", "", source[0], flags=re.M | re.S)
        source[0] = re.sub(r"^play\n(?=```$)", "", source[0], flags=re.M)


def _with_source(app: Any) -> list[Any]:
    """The list of pages of source has none of the compiled module."""
    modules = getattr(app.env, "_viewcode_modules", {})
    app.env._viewcode_modules = {name: found for name, found in modules.items() if found}
    return []


def setup(app: Any) -> None:
    # Tables in text are shown as they are.
    app.add_lexer("csv", TextLexer)
    app.connect("autodoc-process-docstring", _escape, priority=100)
    app.connect("autodoc-process-docstring", _restore, priority=900)
    app.connect("builder-inited", gallery_pictures.put_thumbnails, priority=900)
    app.connect("doctree-read", _link_types)
    app.connect("doctree-read", _cards)
    app.connect("missing-reference", _public)
    app.connect("source-read", _links)
    app.connect("html-collect-pages", _with_source, priority=100)
