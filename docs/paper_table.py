"""Makes the table of ``paper.md``: every item of the paper, its function, its tests and its page.

``python docs/paper_table.py`` writes the table anew. `problems` checks that everything that it names exists.
"""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).parent
ROOT = DOCS.parent
PAGE = DOCS / "paper.md"
SOURCES = ROOT / "crates/core/src"
BEGIN, END = "<!-- table -->\n", "<!-- end of table -->\n"


class Row(NamedTuple):
    """One item of the paper."""

    item: str
    what: str
    # Importable names, without the leading "symspline.".
    functions: str
    # A file and the name of a test function in it; the file alone where all of it is meant.
    tests: str
    # Pages of the documentation, below `docs`, with the anchor of a heading; "gallery/…" are examples.
    pages: str
    # Rust files below `SOURCES`, each with the function of the equation.
    source: str = ""


LEMMAS = "tests/evidence/test_lemmas.py::"
LAWS = "tests/spaces/test_laws.py::"
C2 = "tests/fit/test_c2.py::test_the_curve_is_c2"
ISOMETRY = "tests/spaces/test_actions.py::test_elements_are_isometries"
EXAMPLES = "tests/examples/test_examples.py::test_a_recipe_draws_a_picture"
CERTIFICATE = "tests/spline/test_certificate.py::"
SPACES = f"{ISOMETRY} {LAWS}test_exp_and_log_are_inverse {C2}"
REGION = "solvers_tables.md#theorem-31-and-measurements"

ROWS = [
    Row("Problem 1.1", "C² curve through points", "CubicSpline", C2, "start.md#a-first-curve"),
    Row(
        "(1)",
        "energy that Riemannian cubics minimise",
        "CubicSpline.bending_energy riemannian_cubic",
        "tests/spline/test_lengths.py::test_length_and_energy_by_quadrature "
        "tests/spline/test_riemannian_cubics.py::test_energy_is_stationary_and_a_minimum "
        "tests/evidence/test_comparisons.py::test_spline_is_close_to_the_cubic_and_bends_more",
        "comparisons.md#how-close-to-riemannian-cubics",
        source="fit/energy.rs::bending",
    ),
    Row(
        "Introduction, parallelism",
        "each iteration is parallel",
        "set_num_threads",
        "tests/host/test_threads.py::test_fits_do_not_depend_on_the_number_of_threads",
        "guide/batches.md#threads",
    ),
    Row("Table 1, row 1", "Euclidean space ℝⁿ = SE(n)/SO(n)", "Euclidean", SPACES, "notation.md"),
    Row("Table 1, row 2", "n-sphere Sⁿ = O(n+1)/O(n)", "Sphere", SPACES, "notation.md"),
    Row("Table 1, row 3", "hyperbolic space Hⁿ = O(n,1)/O(n)", "Hyperbolic", SPACES, "notation.md"),
    Row(
        "Table 1, row 4",
        "real Grassmannian Gr(k,n) = O(n)/(O(k) × O(n−k))",
        "Grassmannian",
        SPACES,
        "notation.md",
    ),
    Row(
        "Table 1, row 5",
        "orthogonal group O(n) = (O(n) × O(n))/O(n)",
        "Orthogonal SpecialOrthogonal",
        SPACES,
        "notation.md",
    ),
    Row(
        "Table 1, row 6",
        "complex projective space ℂPⁿ = U(n+1)/(U(n) × U(1))",
        "ComplexProjective",
        SPACES,
        "notation.md",
    ),
    Row(
        "Table 1, row 7",
        "complex Grassmannian U(n)/(U(k) × U(n−k))",
        "ComplexGrassmannian",
        SPACES,
        "notation.md",
    ),
    Row("Table 1, row 8", "unitary group U(n) = (U(n) × U(n))/U(n)", "Unitary", SPACES, "notation.md"),
    Row(
        "Table 1, row 9",
        "covariance matrices P(n) = GL(n)/O(n)",
        "SymmetricPositiveDefinite",
        SPACES,
        "notation.md",
    ),
    Row(
        "(2), (9)",
        "action of the group",
        "Space.act",
        f"{ISOMETRY} tests/spaces/test_actions.py::test_elements_act_as_a_group",
        "theory/symmetric_spaces.md",
    ),
    Row(
        "(3), (4)",
        "splitting of the Lie algebra",
        "Space.symmetry",
        f"{LEMMAS}test_equations_3_and_4_symmetric_splitting",
        "theory/symmetric_spaces.md",
    ),
    Row(
        "(5), (6)",
        "geodesics as orbits of the group",
        "Space.geodesic",
        f"{LEMMAS}test_equations_6_and_10_geodesics_are_orbits",
        "theory/symmetric_spaces.md",
    ),
    Row(
        "(7)",
        "ends of a geodesic",
        "Space.geodesic",
        f"{LAWS}test_geodesic_divides_the_distance",
        "theory/de_casteljau.md",
        source="space/traits.rs::geodesic",
    ),
    Row(
        "(8)",
        "De Casteljau's construction; its last geodesic is from q₁ to p₁",
        "BezierCurve CubicSpline.control_points",
        "tests/free/test_free_curves.py::test_a_cubic_is_a_segment_of_the_spline",
        "theory/de_casteljau.md gallery/de_casteljau.rst",
        source="curve/bezier.rs::at",
    ),
    Row(
        "(10)",
        "movement E",
        "Space.transvection Space.exp",
        f"{LEMMAS}test_equations_6_and_10_geodesics_are_orbits "
        f"{LAWS}test_transvection_is_the_product_of_two_symmetries",
        "theory/symmetric_spaces.md",
        source="space/traits.rs::transvect",
    ),
    Row(
        "(11)",
        "logarithm",
        "Space.log",
        f"{LAWS}test_exp_and_log_are_inverse",
        "theory/symmetric_spaces.md",
        source="space/traits.rs::log",
    ),
    Row(
        "(12)",
        "C¹ condition",
        "CubicSpline.control_points",
        C2,
        "theory/c2_condition.md gallery/c2_condition.rst",
        source="curve/bezier.rs::read",
    ),
    Row(
        "(13)",
        "C² condition",
        "Report.residual",
        C2,
        "theory/c2_condition.md gallery/c2_condition.rst",
        source="fit/condition.rs::sweep",
    ),
    Row(
        "Theorem 2.2",
        "(12) and (13) make the curve C²",
        "CubicSpline",
        C2,
        "theory/c2_condition.md theorem.md",
    ),
    Row(
        "Remark 2.3, (14), (15)",
        "differences in Euclidean space",
        "CubicSpline",
        "tests/fit/test_curve_laws.py::test_flat_space_of_splines_is_scipy",
        "theory/c2_condition.md theorem.md",
    ),
    Row(
        "(16)–(18)",
        'iteration map: `method="fixed-point"`',
        "CubicSpline",
        "tests/fit/test_solvers.py::test_every_iterate_is_that_of_the_paper",
        "theory/algorithm.md solvers.md",
        source="space/traits.rs::inner_handles fit/fixed_point.rs::solve",
    ),
    Row(
        "(19)",
        "clamped spline: `bc_type=((1, v), (1, w))`",
        "CubicSpline",
        "tests/spline/test_ends.py::test_end_conditions_hold",
        "theory/ends.md guide/ends.md",
        source="fit/fixed_point.rs::end_velocity fit/ends.rs::residual",
    ),
    Row(
        "(20)",
        'natural spline: `bc_type="natural"`',
        "CubicSpline",
        "tests/spline/test_ends.py::test_end_conditions_hold",
        "theory/ends.md guide/ends.md",
        source="fit/fixed_point.rs::end_velocity fit/ends.rs::residual",
    ),
    Row(
        "(21)",
        "D",
        "Report.max_step",
        f"{CERTIFICATE}test_radius_is_the_smallest_of_38",
        f"theory/convergence.md {REGION}",
        source="fit/unroll.rs::walk_sized",
    ),
    Row(
        "(22)",
        "K",
        "Space.curvature",
        "tests/evidence/test_curvature.py::test_curvature_is_the_largest_triple_product",
        "theory/symmetric_spaces.md",
        source="space/traits.rs::curvature",
    ),
    Row(
        "Algorithm 1",
        'control points: `method="fixed-point"`',
        "CubicSpline",
        "tests/fit/test_solvers.py::test_every_iterate_is_that_of_the_paper "
        "tests/fit/test_solvers.py::test_fixed_point_is_linear_with_a_rate_of_one_half",
        "theory/algorithm.md solvers.md",
        source="fit/fixed_point.rs::solve",
    ),
    Row(
        "Theorem 3.1",
        "linear convergence of Algorithm 1",
        "Report.invariant_radius Report.contraction_bound",
        "tests/evidence/test_theorem_3_1.py::test_algorithm_1_stays_within",
        "theory/convergence.md convergence.md",
        source="fit/theorem.rs::invariant_radius fit/theorem.rs::contraction_bound",
    ),
    Row(
        "Section 4.1, (23)",
        "unit quaternions on S³ and on SO(3)",
        "Sphere rotations.from_quaternions",
        "tests/spaces/test_identities.py::test_rotations_have_two_quaternions",
        "gallery/five_orientations.rst",
    ),
    Row(
        "Section 4.1, compact groups",
        "the structure (G × G)/G of any compact group",
        "SpecialOrthogonal SpecialUnitary Unitary",
        "tests/evidence/test_so4.py::test_so4_is_two_quaternions",
        "totally-geodesic.md",
    ),
    Row(
        "Section 4.2, step 1",
        "curve through quantum states",
        "ComplexProjective",
        "tests/quantum/test_hamiltonian.py::test_the_schroedinger_equation_goes_through_every_point",
        "gallery/qubit_control.rst",
    ),
    Row(
        "Section 4.2, step 2",
        "lift to the group, and the Hamiltonian of least norm",
        "CubicSpline.lift quantum.hamiltonian quantum.propagator",
        "tests/quantum/test_hamiltonian.py::test_changes_cost_twice_the_bending_energy "
        "tests/quantum/test_propagator.py::test_it_is_unitary_and_follows_the_curve",
        "gallery/qubit_control.rst",
    ),
    Row(
        "Section 4.2, footnote",
        "the Hamiltonian of least change",
        "quantum.LeastChangeHamiltonian",
        "tests/quantum/test_least_change.py::test_no_other_hamiltonian_varies_less",
        "guide/quantum.md#the-hamiltonian-of-least-change",
    ),
    Row(
        "Section 4.3",
        "affine shapes as points of a Grassmannian",
        "shapes.from_landmarks",
        "tests/shapes/test_landmarks.py::test_affine_images_have_one_shape "
        "tests/shapes/test_landmarks.py::test_kernels_are_the_other_way_to_say_it",
        "shapes.md",
    ),
    Row(
        "(24), (25)",
        "half sphere and its stereographic projection",
        "CubicSpline.plot",
        "tests/evidence/test_shapes_figures.py::test_equations_24_and_25_draw_the_curve_in_the_unit_disc",
        "shapes.md",
    ),
    Row(
        "Outlook 1",
        "symmetric spaces that are not Riemannian",
        "SpecialEuclidean GeneralLinear Lorentz DeSitter AntiDeSitter IndefiniteGrassmannian",
        f"{C2} tests/spaces/test_actions.py::test_the_spline_commutes_with_the_group",
        "theorem.md totally-geodesic.md#groups-of-matrices-without-a-metric",
    ),
    Row(
        "Outlook 2",
        "Lie groups and Stiefel manifolds",
        "GeneralLinear Stiefel",
        "tests/manifolds/test_manifold_curves.py::test_equation_13_is_not_enough "
        "tests/manifolds/test_manifold_curves.py::test_all_ends_on_a_stiefel_manifold "
        "tests/manifolds/test_reductive_splines.py::test_left_translations_suffice",
        "manifolds.md#the-condition theorem.md#reductive-spaces",
    ),
    Row(
        "Outlook 3",
        "Riemannian manifolds by the condition of Popiel and Noakes",
        "Manifold",
        "tests/manifolds/test_manifold_curves.py::test_acceleration_is_continuous "
        "tests/manifolds/test_manifold_curves.py::test_symmetric_spaces_give_the_same_curve",
        "manifolds.md",
    ),
    Row(
        "Outlook 4",
        'Newton iteration: `method="newton"`',
        "CubicSpline",
        "tests/fit/test_solvers.py::test_newton_takes_one_step_in_flat_space "
        "tests/fit/test_solvers.py::test_newton_converges_quadratically",
        "theory/newton.md solvers.md",
        source="fit/solve.rs::solve",
    ),
    Row(
        "(26)",
        "connection",
        "Space.transport",
        f"{LEMMAS}test_equation_26_connection_is_consistent_and_equivariant",
        "theory/symmetric_spaces.md",
        source="space/traits.rs::parallel_transport",
    ),
    Row(
        "Lemma A.1",
        "derivative of ξ ↦ exp(ξ) · p",
        "Space.act",
        f"{LEMMAS}test_lemma_a1_derivative_of_the_orbit_map",
        "theory/symmetric_spaces.md",
    ),
    Row(
        "Lemma A.2",
        "π dexp = sinh(ad)/ad",
        "Space.exp Space.transvection",
        f"{LEMMAS}test_lemma_a2_dexp_is_sinh_ad_over_ad",
        "theory/symmetric_spaces.md",
    ),
    Row(
        "Lemma A.3",
        "derivative of the symmetry",
        "Space.symmetry",
        f"{LEMMAS}test_lemma_a3_derivative_of_the_symmetry",
        "notation.md",
    ),
    Row(
        "Lemma A.4",
        "equivariance of the logarithm",
        "Space.log Space.act",
        f"{LEMMAS}test_lemma_a4_logarithm_is_equivariant",
        "notation.md",
    ),
    Row(
        "Lemma A.5",
        "bounds of sinh(ad)/ad and its inverse",
        "Space.curvature",
        f"{LEMMAS}test_lemma_a5_bounds_of_dexp",
        "convergence.md",
    ),
    Row(
        "Lemma A.6, (27), (28)",
        "logarithms and distances",
        "Space.log Space.distance",
        f"{LEMMAS}test_lemma_a6_distance_of_logarithms",
        "convergence.md",
    ),
    Row(
        "(29)–(31)",
        "C² condition of Popiel and Noakes",
        "Space.symmetry Manifold",
        f"{LEMMAS}test_equation_29_is_the_c2_condition",
        "theory/c2_condition.md theorem.md",
    ),
    Row(
        "(32), (33)",
        "ends as parts of the iteration map",
        "CubicSpline",
        f"{LEMMAS}test_proposition_c6_clamped_ends_stay",
        "convergence.md",
    ),
    Row(
        "(34)–(37)",
        "ω, φ, and their norms",
        "Space.log Space.transvection",
        f"{LEMMAS}test_equations_34_to_37",
        "convergence.md",
    ),
    Row(
        "(38)",
        "V; U − V denotes D + V",
        "Report.invariant_radius",
        f"{CERTIFICATE}test_radius_is_the_smallest_of_38",
        f"theory/convergence.md {REGION}",
        source="fit/theorem.rs::invariant_radius",
    ),
    Row(
        "Proposition C.1",
        "invariant region",
        "Report.invariant_radius",
        "tests/evidence/test_theorem_3_1.py::test_algorithm_1_stays_within",
        f"theory/convergence.md {REGION}",
    ),
    Row(
        "Lemma C.2",
        "bounds of φ⁺ and φ⁻",
        "Report.invariant_radius",
        f"{LEMMAS}test_lemma_c2_bounds_of_the_halves",
        "convergence.md",
    ),
    Row(
        "Proposition C.3, (39)",
        "∂φᵢ/∂ξᵢ₊₁",
        "Report.contraction_bound",
        f"{LEMMAS}test_proposition_c3_derivative_by_a_neighbour",
        "convergence.md",
    ),
    Row(
        "Proposition C.4, (41), (42)",
        "∂φᵢ/∂ξᵢ",
        "Report.contraction_bound",
        f"{LEMMAS}test_proposition_c4_derivative_by_itself",
        "convergence.md",
    ),
    Row(
        "Lemma C.5, (40)",
        "∂ωᵢ/∂ξᵢ",
        "Report.contraction_bound",
        f"{LEMMAS}test_lemma_c5_derivative_of_omega",
        "convergence.md",
    ),
    Row(
        "Proposition C.6",
        "derivatives of the ends",
        "Report.contraction_bound",
        f"{LEMMAS}test_proposition_c6_derivative_of_a_natural_end "
        f"{LEMMAS}test_proposition_c6_clamped_ends_stay",
        "convergence.md",
    ),
    Row(
        "Figures 1, 4",
        "De Casteljau's construction",
        "BezierCurve",
        EXAMPLES,
        "figures.md#figures-1-and-4-de-casteljaus-construction gallery/de_casteljau.rst",
    ),
    Row(
        "Figures 2, 3",
        "movement and C² condition",
        "Space.transvection",
        EXAMPLES,
        "figures.md#figures-2-and-3-movement-and-condition-13 gallery/c2_condition.rst",
    ),
    Row(
        "Figure 5",
        "five orientations",
        "CubicSpline.plot",
        EXAMPLES,
        "figures.md#figure-5-five-orientations gallery/five_orientations.rst",
    ),
    Row(
        "Figure 6",
        "six states of a qubit",
        "CubicSpline.plot",
        EXAMPLES,
        "figures.md#figure-6-six-states-of-a-qubit gallery/qubit_control.rst",
    ),
    Row(
        "Figures 7, 8, 9",
        "affine shapes",
        "shapes.from_landmarks",
        f"{EXAMPLES} tests/evidence/test_shapes_figures.py::test_the_figures_of_the_page",
        "figures.md#figures-7-8-and-9-affine-shapes gallery/affine_shapes.rst shapes.md",
    ),
    Row(
        "Figure 10",
        "region of Theorem 3.1",
        "Report.invariant_radius",
        EXAMPLES,
        "figures.md#figure-10-the-region-of-convergence gallery/where_the_iteration_converges.rst",
    ),
    Row(
        "Appendix D",
        "the authors' package",
        "CubicSpline",
        "tests/evidence/test_authors.py::test_the_authors_package_makes_the_same_curve "
        "tests/fit/test_c2.py::test_the_three_points_of_the_paper",
        "notation.md#the-package-of-the-paper",
    ),
]


def has_function(name: str) -> bool:
    """Whether a dotted name can be imported, as a module, an attribute of one, or a field of a class."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            thing = importlib.import_module(".".join(parts[:count]))
        except ImportError:
            continue
        for part in parts[count:]:
            if part in getattr(thing, "__annotations__", {}):
                return part == parts[-1]
            if not hasattr(thing, part):
                return False
            thing = getattr(thing, part)
        return True
    return False


def has_test(name: str) -> bool:
    """Whether a file has a test function of a name."""
    file, _, function = name.partition("::")
    path = ROOT / file
    if not path.is_file():
        return False
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    return function in names if function else any(found.startswith("test_") for found in names)


def has_source(name: str) -> bool:
    """Whether a Rust file has a function of a name."""
    file, _, function = name.partition("::")
    path = SOURCES / file
    return path.is_file() and bool(re.search(rf"\bfn {function}\b", path.read_text(encoding="utf-8")))


def anchors(text: str) -> set[str]:
    """The anchors of the headings of a Markdown page, as MyST and GitHub make them."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings}


def has_page(name: str) -> bool:
    """Whether a page is there, and has the heading of the anchor."""
    file, _, anchor = name.partition("#")
    if file.startswith("gallery/"):
        # Its pages are made of the examples.
        return (ROOT / "examples" / Path(file).with_suffix(".py").name).is_file()
    path = DOCS / file
    return path.is_file() and (not anchor or anchor in anchors(path.read_text(encoding="utf-8")))


def problems() -> list[str]:
    """Every function, test, page and source of the table that does not exist."""
    missing = []
    for row in ROWS:
        missing += [
            name for name in (f"symspline.{part}" for part in row.functions.split()) if not has_function(name)
        ]
        missing += [name for name in row.tests.split() if not has_test(name)]
        missing += [name for name in row.pages.split() if not has_page(name)]
        missing += [name for name in row.source.split() if not has_source(name)]
    return sorted(set(missing))


def _linked(page: str) -> str:
    """A link, or the name alone of a page that is not there yet."""
    path = Path(page.partition("#")[0])
    title = ": ".join([*path.parts[:-1], path.stem.replace("_", " ")])
    return f"[{title}]({page})" if has_page(page) else f"`{page}`"


def table() -> str:
    """The table in Markdown."""
    lines = ["| item | what | function | test | page | source |", "|---|---|---|---|---|---|"]
    for row in ROWS:
        functions = ", ".join(f"`{name}`" for name in row.functions.split())
        tests = ", ".join(f"`{name.removeprefix('tests/')}`" for name in row.tests.split())
        pages = ", ".join(map(_linked, row.pages.split()))
        source = ", ".join(f"`{name}`" for name in row.source.split())
        cells = (row.item, row.what, functions, tests, pages, source)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def written(text: str) -> str:
    """A page with the table between its two marks."""
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + "\n" + table() + "\n" + END + rest.partition(END)[2]


def main() -> None:
    """Writes the table into the page."""
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    for name in problems():
        print(f"missing: {name}")


if __name__ == "__main__":
    main()
