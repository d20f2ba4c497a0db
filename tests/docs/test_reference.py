"""How the pages of the reference are made: the groups of members, and the names that link to other projects."""

import inspect
import re
import zlib
from pathlib import Path

import api_members
import inventories
import pytest

import symspline as ss

DOCS = Path(__file__).parents[2] / "docs"


def test_calls_come_first_and_every_member_of_a_curve_has_a_group():
    for name, groups in api_members.all_grouped().items():
        names = [member for _, members in groups for _, member in members]
        assert len(set(names)) == len(names), name
        if "__call__" in names:
            first = [member for title, members in groups if title != "Construct" for _, member in members]
            assert first[0] == "__call__", name
    for cls in (ss.CubicSpline, ss.SmoothingSpline, ss.BSpline, ss.CumulativeBSpline, ss.GridSpline, ss.Space):
        assert api_members.REST not in dict(api_members.grouped(cls)), cls


def test_members_are_those_of_the_class_itself():
    found = api_members.members(ss.CubicSpline)
    assert found["__call__"] == "automethod" and found["points"] == "autoproperty" and "__init__" not in found
    # Fields are described by the docstring of the class, and those of all spaces on the page of `Space`.
    assert "residual" not in api_members.members(ss.Report)
    assert set(api_members.members(ss.Sphere)) == {"as_angles", "from_angles"}
    public = {name for name, thing in inspect.getmembers(ss.Space) if not name.startswith("_") and thing.__doc__}
    assert public == set(api_members.members(ss.Space))


@pytest.mark.parametrize("project", inventories.PROJECTS)
def test_inventories_are_up_to_date(project):
    data = (DOCS / f"inventories/{project}.inv").read_bytes()
    head, _, compressed = data.partition(b"zlib.\n")
    assert head.startswith(b"# Sphinx inventory version 2\n")
    expected = inventories.inventory(project).partition(b"zlib.\n")[2]
    assert zlib.decompress(compressed) == zlib.decompress(expected)


def test_every_link_has_a_name():
    for domain, role, target in inventories.TYPES.values():
        assert any(
            target in names and names[target][0] == f"{domain}:{role}" for _, names in inventories.PROJECTS.values()
        )


def test_formulas_of_pages_are_balanced():
    for page in [*DOCS.glob("*.md"), *(DOCS / "theory").glob("*.md")]:
        text = re.sub(r"^```.*?^```$|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
        for formula in re.findall(r"\$\$(.*?)\$\$|(?<![\\$])\$([^$\n]+)\$", text, re.S):
            body = "".join(formula)
            assert body.count("{") == body.count("}"), f"{page.name}: {body}"
            assert len(re.findall(r"\\left\b", body)) == len(re.findall(r"\\right\b", body)), f"{page.name}: {body}"
