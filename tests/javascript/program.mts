// A program that uses every type of the package; it is compiled, not run.

import {
  init, makeSmoothingSpline, ConvergenceError, CubicSpline, CutLocusError, Space, SymsplineError, ValidationError,
} from "symspline";
import type { BCType, CubicSplineOptions, Report, SmoothingSpline } from "symspline";

await init(new URL("https://example.org/symspline_bg.wasm"));
const ends: BCType = ["natural", [1, [0, 0, 1]]];
const options: CubicSplineOptions = { bcType: ends, method: "newton", tol: 1e-10, extrapolate: "geodesic", atol: 1e-6 };
const spline = new CubicSpline([0, 1, 2], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2", options);
const one: Float64Array = spline.evaluate(0.5, 1);
const many: Float64Array[] = spline.evaluate(new Float64Array([0.5, 1]), 2);
const same: Float64Array = spline.evaluateInto([0, 1], new Float64Array(6));
const report: Report = spline.report;
const [start, end]: [number, number] = spline.domain;
const matrices = [[[1, 0], [0, 1]], [[2, 0], [0, 1]]];
const smooth: SmoothingSpline = makeSmoothingSpline(null, matrices, new Space("spd:2"), { lam: 1, loss: "huber" });
const radius: number = smooth.band(start + end, 0.9);
const radii: Float64Array = smooth.std([0, 1]);
new CubicSpline(null, new Float64Array(9), "sphere:2").free();

const both: [number[][], number[][][]] = [[[0, 0], [1, 2]], [[[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, -1, 0], [1, 0, 0], [0, 0, 1]]]];
const path = new CubicSpline(null, both, "r:2 x so:3", { bcType: ["natural", [1, [[0, 0], new Float64Array(9)]]] });
const place: Float64Array[] = path.evaluate(0.5);
const places: Float64Array[][] = path.evaluate([0.5, 1], 1);
const written: Float64Array[] = path.evaluateInto([0.5], [new Float64Array(2), new Float64Array(9)]);
const turn: number[][] = path.space.pointShape;
const lams: number[] = makeSmoothingSpline(null, both, new Space("r:2 x so:3"), { lam: [1, null], sigma: 0.1 }).lam;
const far: number = new Space("r:1 x r:1").distance([[0], [1]], [[3], [5]]);
const name: string = ["r:2", "so:3"].join(" x ");
new CubicSpline(null, both as never, name);

// @ts-expect-error: points of a product are arrays with one entry per factor.
const flat: Float64Array = path.evaluate(0.5);
// @ts-expect-error: λ of a space that is not a product is one number.
makeSmoothingSpline(null, matrices, "spd:2", { lam: [1, 2] });
// @ts-expect-error: there is no such end condition.
new CubicSpline(null, matrices, "spd:2", { bcType: "free" });
// @ts-expect-error: derivatives have order 0, 1 or 2.
spline.evaluate(0.5, 3);
// @ts-expect-error: it is created by makeSmoothingSpline.
new SmoothingSpline();

try {
  new Space("sphere:2").geodesic([1, 0, 0], [0, 1, 0], [0, 0.5]);
} catch (error) {
  if (error instanceof CutLocusError || error instanceof ValidationError || error instanceof ConvergenceError) {
    const base: SymsplineError = error;
    console.log(base.argument, base.index, base.value, base.limit, base.factor);
  }
}
console.log(one, many, same, report, radius, radii, Space.names, place, places, written, turn, lams, far, flat);
