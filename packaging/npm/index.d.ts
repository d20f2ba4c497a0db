// Types of the package symspline, written and checked by hand; `make test-wasm` compiles a program against them.

/** Bytes of the compiled module, a place to fetch it from, or a compiled module. */
export type WasmSource = URL | string | Response | BufferSource | WebAssembly.Module | Promise<Response>;

/** Loads the compiled module. Await it once before anything else; later calls return at once. */
export function init(source?: WasmSource): Promise<void>;

/** A number array of any kind. */
export type Numbers = ArrayLike<number>;

/** A point or tangent vector: its numbers, or the rows of a matrix. */
export type PointLike = Numbers | ArrayLike<Numbers>;

/** Points: an array of them, or a `Float64Array` of all their numbers, point after point. */
export type PointsLike = ArrayLike<PointLike> | Float64Array;

/** A condition at one end: a word, a velocity `[1, v]`, or a covariant acceleration `[2, a]`. */
export type EndCondition = "natural" | "not-a-knot" | "clamped" | readonly [order: 1 | 2, vector: PointLike];

/** End conditions: the same word for both ends, one condition per end, or `"periodic"`. */
export type BCType = "natural" | "not-a-knot" | "clamped" | "periodic" | readonly [EndCondition, EndCondition];

/** Evaluation outside the knots: an error, the last segment, constant velocity, or repetition. */
export type Extrapolate = "raise" | true | "geodesic" | "periodic" | null;

/** Order of the derivative: the point, the velocity, or the covariant acceleration. */
export type Nu = 0 | 1 | 2;

export interface CubicSplineOptions {
  /** End conditions; default `"natural"`. `"not-a-knot"` is more accurate for samples of a smooth motion. */
  bcType?: BCType;
  /** Solver of the C² condition; default `"auto"`. */
  method?: "auto" | "fixed-point" | "quasi-newton" | "newton" | "homotopy";
  /** Largest relative C² residual of a converged fit; default 1e-12. */
  tol?: number;
  /** Evaluation outside the knots; default `"raise"`. */
  extrapolate?: Extrapolate;
  /** Distance from the space at which a point is refused; default 1e-8. */
  atol?: number;
}

export interface SmoothingOptions {
  /** Smoothing parameter λ; by default generalised cross-validation chooses it. */
  lam?: number | null;
  /** One weight per point, proportional to the inverse variance of its noise; default 1. */
  weights?: Numbers | null;
  /** Knots, from the first to the last time; by default all times. */
  knots?: Numbers | null;
  /** Standard deviation of the noise in one coordinate; by default it is estimated. */
  sigma?: number | null;
  /** Weight of a degree of freedom in cross-validation, at least 1; default 1.2. */
  gamma?: number;
  /** Loss of a residual; default `"linear"`. The others downweight outliers. */
  loss?: "linear" | "huber" | "cauchy";
  /** End conditions; default `"natural"`. */
  bcType?: "natural" | "periodic";
  /** Evaluation outside the knots; default `"raise"`. */
  extrapolate?: Extrapolate;
  /** Distance from the space at which a point is refused; default 1e-8. */
  atol?: number;
}

/** Report of a fit. */
export interface Report {
  readonly iterations: number;
  /** Relative C² residual. */
  readonly residual: number;
  /** Longest distance between neighbouring points, D of (21) of the paper. */
  readonly maxStep: number;
  /** Solver that found the curve. */
  readonly method: string;
}

/** A space by its name, such as `"sphere:2"`, `"so:3"`, `"se:3"`, `"spd:2"`, `"h:2"` or `"r:3"`. */
export class Space {
  constructor(name: string);
  /** Names of all spaces. */
  static readonly names: string[];
  readonly name: string;
  /** Shape of the array of a point. */
  readonly pointShape: number[];
  /** Count of numbers in a point. */
  readonly length: number;
  readonly dim: number;
  /** Distance below which two points are joined by one shortest geodesic. */
  readonly injectivityRadius: number;
  /** Point reached from p along the geodesic with velocity v, at time 1. */
  exp(p: PointLike, v: PointLike): Float64Array;
  /** Velocity of the geodesic from p that reaches q at time 1. */
  log(p: PointLike, q: PointLike): Float64Array;
  distance(p: PointLike, q: PointLike): number;
  /** Inner product of two tangent vectors at p. */
  inner(p: PointLike, u: PointLike, v: PointLike): number;
  /** Length of a tangent vector at p. */
  norm(p: PointLike, v: PointLike): number;
  /** Closest point of the space. */
  project(x: PointLike): Float64Array;
  /** Points of the geodesic from p (t = 0) to q (t = 1). */
  geodesic(p: PointLike, q: PointLike, t: number): Float64Array;
  geodesic(p: PointLike, q: PointLike, t: Numbers): Float64Array[];
}

declare abstract class Curve {
  readonly space: Space;
  /** Knots. */
  readonly t: Float64Array;
  /** Points at the knots. */
  readonly points: Float64Array[];
  /** Velocities at the knots. */
  readonly velocities: Float64Array[];
  /** First and last knot. */
  readonly domain: [number, number];
  readonly report: Report;
  /** Four control points per segment, which is a cubic Bézier curve. */
  readonly controlPoints: Float64Array[][];
  /** Point, velocity (`nu` = 1) or covariant acceleration (`nu` = 2) at one time or several. */
  evaluate(x: number, nu?: Nu): Float64Array;
  evaluate(x: Numbers, nu?: Nu): Float64Array[];
  /** The same, written point after point into an existing array, which is returned. */
  evaluateInto(x: Numbers, out: Float64Array, nu?: Nu): Float64Array;
  /** Releases the memory of the curve, which otherwise is done some time after its last use. */
  free(): void;
}

/** A C² cubic spline that passes through points. */
export class CubicSpline extends Curve {
  /** `t` null means 0, 1, …, n − 1. */
  constructor(t: Numbers | null, points: PointsLike, space: Space | string, options?: CubicSplineOptions);
  readonly bcType: BCType;
}

/** A C² cubic spline close to noisy points. `makeSmoothingSpline` creates it. */
export class SmoothingSpline extends Curve {
  private constructor();
  /** Smoothing parameter λ. */
  readonly lam: number;
  /** Effective degrees of freedom per coordinate. */
  readonly df: number;
  /** Standard deviation of the noise in one coordinate. */
  readonly sigma: number;
  /** Standard deviation of the curve in one coordinate. */
  std(x: number): number;
  std(x: Numbers): Float64Array;
  /** Radius of the ball that contains the true point with a probability, 0.95 by default. */
  band(x: number, level?: number): number;
  band(x: Numbers, level?: number): Float64Array;
}

/** Fits a curve close to noisy points: the one with the smallest Σ wⱼ d(yⱼ, γ(tⱼ))² + λ ∫ ‖∇γ′‖² dt. */
export function makeSmoothingSpline(
  t: Numbers | null,
  points: PointsLike,
  space: Space | string,
  options?: SmoothingOptions,
): SmoothingSpline;

/** Base class of all errors. */
export class SymsplineError extends Error {
  /** Name of the argument that the error is about. */
  readonly argument: string | null;
  /** Index in that argument: of the node, or of the first of two nodes. */
  readonly index: number | null;
  /** Number that was found, such as an angle or a residual. */
  readonly value: number | null;
  /** Limit of that number. */
  readonly limit: number | null;
}

/** The input does not meet the requirements. */
export class ValidationError extends SymsplineError {}

/** Two points are not joined by a unique shortest geodesic: they lie at or past each other's cut locus. */
export class CutLocusError extends SymsplineError {}

/** The solver did not reach the tolerance, or the data do not determine a smooth curve. */
export class ConvergenceError extends SymsplineError {}
