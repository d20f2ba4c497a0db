"""Makes certificate.png: which steps are certified, and within which radius the spline is the only one."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import symspline as ss

SPACES = {
    "S²": ss.Sphere(2),
    "H²": ss.Hyperbolic(2),
    "SO(3)": ss.SpecialOrthogonal(3),
    "Gr(2, 4)": ss.Grassmannian(2, 4),
}
# Theorem 3.1 ends at the first step. At the second one the equations of zigzags on S² become singular.
THEOREM, THRESHOLD = 0.26058, 1.30654


def walks(space: ss.Space, kd: float, count: int, nodes: int = 12, seed: int = 0) -> np.ndarray:
    """Random walks whose steps all have the length `kd` / K."""
    rng = np.random.default_rng(seed)
    start = [1.0, 0.0, 0.0] if isinstance(space, ss.Hyperbolic) else space.random_point(rng)
    points = [np.broadcast_to(start, (count, *space.point_shape))]
    for _ in range(nodes - 1):
        v = space.random_tangent(rng, points[-1])
        length = space.norm(points[-1], v).reshape(-1, *[1] * len(space.point_shape))
        points.append(space.exp(points[-1], v * (kd / space.curvature / length)))
    return np.stack(points, axis=1)


def certified(space: ss.Space, kd: float, bc_type: str, count: int = 100) -> tuple[float, float]:
    """The fraction of walks with a certificate, and the median of K R."""
    report = ss.CubicSpline(None, walks(space, kd, count), space, bc_type=bc_type, on_failure="ignore").report
    if report.certificate is None:
        return 0.0, np.nan
    radius = np.asarray(report.certificate.R)
    return float(np.isfinite(radius).mean()), float(np.nanmedian(radius) * space.curvature)


def main() -> None:
    figure = Figure(figsize=(8.5, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    steps = np.linspace(0.02, 1.4, 36)
    for color, (name, space) in enumerate(SPACES.items()):
        for bc_type, style in (("natural", "-"), ("not-a-knot", ":")):
            fractions, radii = np.transpose([certified(space, kd, bc_type) for kd in steps])
            label = name if bc_type == "natural" else None
            left.plot(steps, 100 * fractions, style, color=f"C{color}")
            right.semilogy(steps, radii, style, color=f"C{color}", label=label)
    for axes in (left, right):
        for step, text in ((THEOREM, "Theorem 3.1"), (THRESHOLD, "zigzags")):
            axes.axvline(step, color="0.4", linewidth=0.8, linestyle="--")
            axes.annotate(
                text, (step, 0.02), xycoords=("data", "axes fraction"), rotation=90, ha="right", color="0.3"
            )
        axes.set(xlabel="step K D", xlim=(0, 1.42))
    left.set(ylabel="random walks with a certificate, %", title="Natural (lines) and not-a-knot ends (dots)")
    right.set(ylabel="K R, median", title="The spline is the only one within R", ylim=(3e-4, 2))
    figure.legend(loc="outside right center")
    figure.savefig(Path(__file__).with_name("theory") / "certificate.png", dpi=110)


if __name__ == "__main__":
    main()
