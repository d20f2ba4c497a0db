"""A Sphinx extension that typesets formulas with KaTeX from files of the site, keeps numbers in tables on one line, and
names the theme's buttons for screen readers."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes

# Numbers with a character at which browsers break lines.
BREAKABLE = re.compile(r"([-+−]?\d[\d.,]*(?:e[-+−]?\d+|[-–]\d[\d.,]*)|[-+−]\d[\d.,]*)")
# The parameters of a signature, one on each line.
SIGNATURE = re.compile(r'<dl>\n((?:<dd><em class="sig-param">.*?</dd>\n)+)</dl>', re.S)
KATEX = ("katex/katex.min.js", "math.js")


def _inline(self: Any, node: nodes.Element) -> None:
    self.body.append(self.starttag(node, "span", "", CLASS="math notranslate nohighlight"))
    self.body.append(f"{self.encode(node.astext())}</span>")
    raise nodes.SkipNode


def _display(self: Any, node: nodes.Element) -> None:
    """A displayed formula; its number, if it has one, is a ``\\tag`` of LaTeX."""
    text = node.astext().strip()
    if r"\\" in text and r"\begin" not in text:
        text = rf"\begin{{aligned}}{text}\end{{aligned}}"
    self.body.append(self.starttag(node, "div", "", CLASS="math displayed notranslate nohighlight"))
    self.body.append(f"{self.encode(text)}</div>\n")
    raise nodes.SkipNode


def _mend_signatures(app: Any, page: str, template: str, context: dict[str, Any], doctree: object) -> None:
    """Sphinx writes long signatures as lists of definitions without terms, which screen readers cannot read."""
    if "body" in context:
        context["body"] = SIGNATURE.sub(
            lambda found: f'<div class="sig-lines">\n{found[1].replace("dd>", "div>")}</div>', context["body"]
        )


def _add_files(app: Any, page: str, template: str, context: dict[str, Any], doctree: object) -> None:
    if 'class="math' in context.get("body", ""):
        app.add_css_file("katex/katex.min.css")
        for name in KATEX:
            app.add_js_file(name, loading_method="defer")


def _keep_numbers_whole(app: Any, doctree: nodes.document) -> None:
    """Lines of a table's cell do not break inside a number, such as 1e-5."""
    for entry in doctree.findall(nodes.entry):
        for text in list(entry.findall(nodes.Text)):
            parts = BREAKABLE.split(text)
            if len(parts) > 1 and not isinstance(text.parent, (nodes.literal, nodes.math, nodes.raw)):
                new = [
                    nodes.inline(part, part, classes=["number"]) if i % 2 else nodes.Text(part)
                    for i, part in enumerate(parts)
                    if part
                ]
                text.parent.replace(text, new)


def _name_buttons(app: Any, page: str, template: str, context: dict[str, Any], doctree: object) -> None:
    """The theme's buttons that open a part of the list of pages have no name for screen readers."""
    make = context.get("generate_toctree_html")

    def named(*args: Any, **options: Any) -> Any:
        soup = make(*args, **options)
        for summary in getattr(soup, "find_all", lambda _: ())("summary"):
            if not summary.get_text(strip=True):
                link = summary.find_parent("li").find("a")
                summary["aria-label"] = f"Pages below {link.get_text(strip=True)}" if link else "Pages below"
        return soup

    if make:
        context["generate_toctree_html"] = named


def setup(app: Any) -> dict[str, bool]:
    app.add_html_math_renderer("katex", (_inline, None), (_display, None))
    app.connect("doctree-read", _keep_numbers_whole)
    app.connect("html-page-context", _add_files)
    app.connect("html-page-context", _mend_signatures)
    # After the theme, which puts the function there.
    app.connect("html-page-context", _name_buttons, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
