"""The table of ``docs/paper.md`` is complete, up to date, and names only what exists."""

import re

import paper_table

TEXT = paper_table.PAGE.read_text(encoding="utf-8")


def labels(item):
    """ "(16)–(18)" has the labels (16), (17) and (18); "Figures 1, 4" Figure 1 and Figure 4."""
    for first, last in re.findall(r"\((\d+)\)–\((\d+)\)", item):
        yield from (f"({number})" for number in range(int(first), int(last) + 1))
    yield from re.findall(r"\(\d+\)", item)
    for kind, numbers in re.findall(r"(Figure)s? ([\d, ]+)", item):
        yield from (f"{kind} {number}" for number in re.findall(r"\d+", numbers))
    yield item
    yield item.partition(", (")[0]


WANTED = [
    *("Problem 1.1", "Theorem 2.2", "Theorem 3.1", "Algorithm 1", "Appendix D", "Introduction, parallelism"),
    *(f"({number})" for number in range(1, 43)),
    *(f"Table 1, row {row}" for row in range(1, 10)),
    *(f"Lemma A.{number}" for number in range(1, 7)),
    *(f"Proposition C.{number}" for number in (1, 3, 4, 6)),
    *("Lemma C.2", "Lemma C.5"),
    *(f"Figure {number}" for number in range(1, 11)),
    *("Section 4.1", "Section 4.2, step 1", "Section 4.2, step 2", "Section 4.3"),
    *(f"Outlook {number}" for number in range(1, 5)),
]


def test_the_table_is_complete_and_names_what_exists():
    found = {label for row in paper_table.ROWS for label in labels(row.item)}
    assert [item for item in WANTED if item not in found] == []
    assert paper_table.problems() == []
    assert paper_table.written(TEXT) == TEXT


def test_missing_names_are_found():
    for check, there, missing in [
        (paper_table.has_function, "symspline.Space.exp", "symspline.Space.exponential"),
        (paper_table.has_function, "symspline.Report.residual", "symspline.Report.residuals"),
        (paper_table.has_function, "symspline.quantum.hamiltonian", "symspline.quanta.hamiltonian"),
        (paper_table.has_test, "tests/docs/test_paper.py::labels", "tests/docs/test_paper.py::label"),
        (paper_table.has_test, "tests/docs/test_paper.py", "tests/docs/test_papers.py"),
        (paper_table.has_source, "fit/condition.rs::sweep", "fit/condition.rs::sweeps"),
        (paper_table.has_source, "fit/condition.rs::sweep", "fit/conditions.rs::sweep"),
        (paper_table.has_page, "notation.md#the-package-of-the-paper", "notation.md#the-package"),
        (paper_table.has_page, "gallery/affine_shapes.rst", "gallery/shapes.rst"),
    ]:
        assert check(there) and not check(missing)
