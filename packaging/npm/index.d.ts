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

/** T on a space that is not a product. On a product, whose name `N` contains " x ", an array with one T per factor. */
export type PerFactor<N extends string, T> = N extends `${string} x ${string}` ? T[] : T;

/** An argument of this kind. On a product, an array with one T per factor. */
export type InFactors<N extends string, T> = N extends `${string} x ${string}` ? readonly T[] : T;

/** A condition at one end: a word, a velocity `[1, v]`, or a covariant acceleration `[2, a]`. */
export type EndCondition<N extends string = string> =
  | "natural" | "not-a-knot" | "clamped" | readonly [order: 1 | 2, vector: InFactors<N, PointLike>];

/** End conditions: the same word for both ends, one condition per end, or `"periodic"`. */
export type BCType<N extends string = string> =
  | "natural" | "not-a-knot" | "clamped" | "periodic" | readonly [EndCondition<N>, EndCondition<N>];

/** Evaluation outside the knots: an error, the last segment, constant velocity, or repetition. */
export type Extrapolate = "raise" | true | "geodesic" | "periodic" | null;

/** Order of the derivative: the point, the velocity, or the covariant acceleration. */
export type Nu = 0 | 1 | 2;

export interface CubicSplineOptions<N extends string = string> {
  /** End conditions; default `"natural"`. `"not-a-knot"` is more accurate for samples of a smooth motion. */
  bcType?: BCType<N>;
  /** Solver of the C² condition; default `"auto"`. */
  method?: "auto" | "fixed-point" | "quasi-newton" | "newton" | "homotopy";
  /** Largest relative C² residual of a converged fit; default 1e-12. */
  tol?: number;
  /** Evaluation outside the knots; default `"raise"`. */
  extrapolate?: Extrapolate;
  /** Distance from the space at which a point is refused; default 1e-8. */
  atol?: number;
}

export interface SmoothingOptions<N extends string = string> {
  /** Smoothing parameter λ; by default generalised cross-validation chooses it. On a product also one per factor. */
  lam?: number | null | InFactors<N, number | null>;
  /** One weight per point, proportional to the inverse variance of its noise; default 1. */
  weights?: Numbers | null;
  /** Knots, from the first to the last time; by default all times. */
  knots?: Numbers | null;
  /** Standard deviation of the noise in one coordinate; by default it is estimated. On a product also one per factor. */
  sigma?: number | null | InFactors<N, number | null>;
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

/** Report of a fit; on a product, the worst of its factors. */
export interface Report {
  readonly iterations: number;
  /** Relative C² residual. */
  readonly residual: number;
  /** Longest distance between neighbouring points, D of (21) of the paper. */
  readonly maxStep: number;
  /** Solver that found the curve. */
  readonly method: string;
}

/**
 * A space by its name, such as `"sphere:2"`, `"so:3"`, `"se:3"`, `"spd:2"`, `"h:2"` or `"r:3"`, or a product of spaces, such
 * as `"so:3 x r:3"`. A point of a product is an array with one point per factor.
 */
export class Space<N extends string = string> {
  constructor(name: N);
  /** Names of all spaces that are not products. */
  static readonly names: string[];
  readonly name: string;
  /** Factors of a product; any other space is its only factor. */
  readonly factors: Space[];
  /** Shape of the array of a point. */
  readonly pointShape: PerFactor<N, number[]>;
  /** Count of numbers in a point, in all factors. */
  readonly length: number;
  readonly dim: number;
  /** Distance below which two points are joined by one shortest geodesic. */
  readonly injectivityRadius: number;
  /** Point reached from p along the geodesic with velocity v, at time 1. */
  exp(p: InFactors<N, PointLike>, v: InFactors<N, PointLike>): PerFactor<N, Float64Array>;
  /** Velocity of the geodesic from p that reaches q at time 1. */
  log(p: InFactors<N, PointLike>, q: InFactors<N, PointLike>): PerFactor<N, Float64Array>;
  /** Distance; on a product, the root of the sum of its squares in the factors. */
  distance(p: InFactors<N, PointLike>, q: InFactors<N, PointLike>): number;
  /** Inner product of two tangent vectors at p. */
  inner(p: InFactors<N, PointLike>, u: InFactors<N, PointLike>, v: InFactors<N, PointLike>): number;
  /** Length of a tangent vector at p. */
  norm(p: InFactors<N, PointLike>, v: InFactors<N, PointLike>): number;
  /** Closest point of the space. */
  project(x: InFactors<N, PointLike>): PerFactor<N, Float64Array>;
  /** Points of the geodesic from p (t = 0) to q (t = 1). */
  geodesic(p: InFactors<N, PointLike>, q: InFactors<N, PointLike>, t: number): PerFactor<N, Float64Array>;
  geodesic(p: InFactors<N, PointLike>, q: InFactors<N, PointLike>, t: Numbers): PerFactor<N, Float64Array[]>;
}

declare abstract class Curve<N extends string> {
  readonly space: Space<N>;
  /** Knots. */
  readonly t: Float64Array;
  /** Points at the knots. */
  readonly points: PerFactor<N, Float64Array[]>;
  /** Velocities at the knots. */
  readonly velocities: PerFactor<N, Float64Array[]>;
  /** First and last knot. */
  readonly domain: [number, number];
  readonly report: Report;
  /** Four control points per segment, which is a cubic Bézier curve. */
  readonly controlPoints: PerFactor<N, Float64Array[][]>;
  /** Point, velocity (`nu` = 1) or covariant acceleration (`nu` = 2) at one time or several. */
  evaluate(x: number, nu?: Nu): PerFactor<N, Float64Array>;
  evaluate(x: Numbers, nu?: Nu): PerFactor<N, Float64Array[]>;
  /** The same, written point after point into an existing array, or one per factor, which is returned. */
  evaluateInto<O extends InFactors<N, Float64Array>>(x: Numbers, out: O, nu?: Nu): O;
  /** Releases the memory of the curve, which otherwise is done some time after its last use. */
  free(): void;
}

/** A C² cubic spline that passes through points. */
export class CubicSpline<N extends string = string> extends Curve<N> {
  /** `t` null means 0, 1, …, n − 1. Points on a product are an array with the points in each factor. */
  constructor(
    t: Numbers | null,
    points: InFactors<N, PointsLike>,
    space: Space<N> | N,
    options?: CubicSplineOptions<N>,
  );
  readonly bcType: BCType<N>;
}

/** A C² cubic spline close to noisy points. `makeSmoothingSpline` creates it. */
export class SmoothingSpline<N extends string = string> extends Curve<N> {
  private constructor();
  /** Smoothing parameter λ. */
  readonly lam: PerFactor<N, number>;
  /** Effective degrees of freedom per coordinate. */
  readonly df: PerFactor<N, number>;
  /** Standard deviation of the noise in one coordinate. */
  readonly sigma: PerFactor<N, number>;
  /** Standard deviation of the curve in one coordinate. */
  std(x: number): PerFactor<N, number>;
  std(x: Numbers): PerFactor<N, Float64Array>;
  /** Radius of the ball that contains the true point with a probability, 0.95 by default. */
  band(x: number, level?: number): PerFactor<N, number>;
  band(x: Numbers, level?: number): PerFactor<N, Float64Array>;
}

/**
 * Fits a curve close to noisy points: the one with the smallest Σ wⱼ d(yⱼ, γ(tⱼ))² + λ ∫ ‖∇γ′‖² dt, in each factor of a
 * product.
 */
export function makeSmoothingSpline<N extends string>(
  t: Numbers | null,
  points: InFactors<N, PointsLike>,
  space: Space<N> | N,
  options?: SmoothingOptions<N>,
): SmoothingSpline<N>;

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
  /** Factor of a product that the error is about. */
  readonly factor: number | null;
}

/** The input does not meet the requirements. */
export class ValidationError extends SymsplineError {}

/** Two points are not joined by a unique shortest geodesic: they lie at or past each other's cut locus. */
export class CutLocusError extends SymsplineError {}

/** The solver did not reach the tolerance, or the data do not determine a smooth curve. */
export class ConvergenceError extends SymsplineError {}
