"""Retired words do not return: pages, docstrings and messages use the standard terms of the field.

Each case has the retired word, its standard term, a pattern for the retired sense, and a sentence that it must match.
Code, links and doctests are not prose and are ignored.
"""

import ast
import re
import tokenize
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "python/symspline"
PAGES = [
    *(ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")),
    ROOT / "benchmarks/README.md",
    ROOT / "docs/api/index.rst",
    ROOT / "examples/index.rst",
    *(path for path in (ROOT / "docs").rglob("*.md") if not {"gallery", "generated"} & set(path.parts)),
]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
MODULES = sorted(PACKAGE.rglob("*.py"))


class Retired(NamedTuple):
    word: str
    standard: str
    pattern: str
    example: str


RETIRED = [
    Retired("leg", "control handle, control polygon", r"\blegs?\b", "the legs of the condition"),
    Retired("defect", "residual", r"\bdefects?\b", "the largest relative defect"),
    Retired("calm", "minimum-energy", r"\bcalm(er|est)?\b", "the calmest curve"),
    Retired("flat way", "linearised solver", r"\bflat way\b", "the flat way is slow"),
    Retired("exact way", "full Gauss–Newton solver", r"\bexact way\b", "the exact way is slow"),
    Retired("bends least", "lowest bending energy", r"\bbends? (least|less|more)\b", "a curve that bends less"),
    Retired("same bits", "bit-identical", r"\bsame bits\b", "each gets the same bits as alone"),
    Retired("doubles", "double precision", r"\bdoubles\b", "computed in doubles"),
    Retired("digits", "significant digits, accuracy", r"(?<!significant )\bdigits\b", "derivatives lose digits"),
    Retired("carry", "parallel transport, contain", r"\bcarr(y|ies|ied)\b", "a vector carried along the curve"),
    Retired("piece", "segment", r"\bpieces?\b", "the pieces of a recording"),
    Retired("stretch", "segment", r"\bstretch(es)?\b", "a curve of each stretch"),
    Retired("handed", "passed, converted", r"(?<!-)\bhanded\b", "matrices handed to a space"),
    Retired("door", "conversion", r"\bdoors?\b", "the door for quaternions"),
    Retired("room", "space, memory", r"\brooms?\b", "points of the room"),
    Retired("page of Rust", "Rust file", r"\bpages? of Rust\b", "a space is one page of Rust"),
    Retired("place", "position, knot, sampling time", r"(?<!decimal )\bplaces\b", "places on a globe"),
    Retired("in span", "in the span of the data", r"\bin span\b", "computed in span"),
    Retired("told", "specified", r"\btold\b", "unless told otherwise"),
    Retired("tell", "describe, report", r"\btells?\b", "the report tells how"),
    Retired("say", "state, describe", r"\b(says|said)\b", "`report` says how the fit went"),
    Retired("know", "has", r"\bknows\b", "the space knows its metric"),
    Retired(
        "is no",
        "is not a",
        r"(?<!there )\b(is|are|was|were|be) no (?!longer\b|more than\b|less than\b)",
        "a long step is no error",
    ),
    Retired("of no", "not on, without", r"\bof no\b", "a time of no time zone"),
    Retired("wanted", "masked, required", r"\bwanted\b", "curves that are wanted"),
    Retired("left out", "masked, omitted", r"\b(left|leaves?) out\b", "points that are left out"),
    Retired("stands for", "represents", r"\bstands? for\b", "an array stands for a point"),
    Retired(
        "follows its data", "sensitivity", r"\bhow (it|an?|the) ?(curve|spline)? follows\b", "how the curve follows"
    ),
    Retired("push", "forward mode", r"\bpush(es|ed)?\b", "push a change through"),
    Retired("pull", "reverse mode", r"\bpull(ed)? back\b", "a gradient is pulled back"),
    Retired("outside", "extrapolation policy", r"\bwhat is outside\b", "what is outside is an error"),
    Retired("clock", "time axis", r"\bclocks?\b", "times of another clock"),
    Retired("there", "existing", r"\b(that|what) (is|are) (not )?there\b", "into an array that is there"),
    Retired("weighing", "precision matrix", r"\bweighing\b", "the weighing of the data"),
    Retired("what noise leaves", "residual sum of squares", r"\bwhat noise leaves\b", "what noise leaves"),
    Retired("seam", "periodic ends", r"\bseams?\b", "the seam of closed curves"),
    Retired("side by side", "SIMD lanes", r"\b(eight|several) \w+ side by side\b", "eight curves side by side"),
    Retired("beside the diagonal", "bandwidth", r"\bbeside the diagonal\b", "places beside the diagonal"),
    Retired("one a", "one per", r"\bone an? (curve|factor|knot|line|point|row|vessel)\b", "a λ for each, one a factor"),
]


def prose(text):
    """A page without code, links, comments and table rules."""
    text = re.sub(r"^(```|::::).*?^\1", "", text, flags=re.M | re.S)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    text = re.sub(r"(`{1,2})[^`\n]+\1", "", text)
    return re.sub(r"\]\([^)]*\)", "]", text)


def without_doctests(text):
    lines = text.splitlines()
    return "\n".join(line for line in lines if not line.lstrip().startswith((">>>", "...")))


def comments(path):
    with path.open("rb") as file:
        return [token.string for token in tokenize.tokenize(file.readline) if token.type == tokenize.COMMENT]


def strings(path):
    """Docstrings and messages: all texts of more than one word."""
    tree = ast.parse(path.read_text("utf-8"))
    texts = (node.value for node in ast.walk(tree) if isinstance(node, ast.Constant))
    return [without_doctests(text) for text in texts if isinstance(text, str) and " " in text.strip()]


@cache
def texts():
    """All prose by file, in lower case, on one line."""
    found = {path: [prose(path.read_text("utf-8"))] for path in PAGES}
    found |= {path: strings(path) + comments(path) for path in EXAMPLES}
    found |= {path: strings(path) + comments(path) for path in MODULES}
    return {
        str(path.relative_to(ROOT)): " ".join(prose("\n".join(parts)).split()).lower() for path, parts in found.items()
    }


@pytest.mark.parametrize("retired", RETIRED, ids=lambda retired: retired.word)
def test_retired_words_do_not_return(retired):
    assert re.search(retired.pattern, prose(retired.example)), "the pattern does not match its own example"
    found = []
    for file, text in texts().items():
        found += [
            f"{file}: …{text[max(match.start() - 40, 0) : match.end() + 40]}…"
            for match in re.finditer(retired.pattern, text)
        ]
    assert not found, f"write {retired.standard!r}:\n" + "\n".join(found)
