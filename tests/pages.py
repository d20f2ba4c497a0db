"""Code and tables of the pages of the documentation."""

import re


def blocks(page, language="python"):
    """The blocks of code of a page, in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S)


def with_output(page):
    """The blocks of Python, each with the block of text after it that shows what it prints, or None."""
    found = re.findall(
        r"^```python\n(.*?)^```$(?:\n\n^```text\n(.*?)^```$)?", page.read_text(encoding="utf-8"), re.M | re.S
    )
    return [(code, output or None) for code, output in found]


def run(code, page, names):
    """Run code of a page among some names, which it may change."""
    exec(compile(code, page.name, "exec"), names)


def cells(table):
    """The cells of a table in Markdown, row by row."""
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()[2:]]
