// Smooth curves through points of curved spaces. The compiled module does the arithmetic; this file reads its input.

import { checked as converted, ConvergenceError, CutLocusError, SymsplineError, ValidationError } from "./errors.js";
import { forFactors, inFactors, joinedRow, joinedRows, known, number, perFactor, row, vector, word } from "./input.js";
import start, * as core from "./symspline.js";

export { ConvergenceError, CutLocusError, SymsplineError, ValidationError };

let started;
let loaded = false;

/** Calls a function of the compiled module. */
function checked(call) {
  if (!loaded) throw new SymsplineError("the compiled module is not loaded: call `await init()` first");
  return converted(call);
}

/** Loads the compiled module. Await it once before anything else. */
export function init(source) {
  started ??= load(source).then((wasm) => start({ module_or_path: wasm })).catch((error) => {
    started = undefined;
    throw error;
  });
  return started.then(() => {
    loaded = true;
  });
}

async function load(source) {
  if (source !== undefined) return source;
  const url = new URL("symspline_bg.wasm", import.meta.url);
  if (url.protocol !== "file:" || typeof process === "undefined") return url;
  // Node.js does not fetch files. The name is hidden from bundlers, which would look for it.
  const files = "node:fs/promises";
  return (await import(/* @vite-ignore */ /* webpackIgnore: true */ files)).readFile(url);
}

/** A space, such as `new Space("sphere:2")`, or a product, such as `new Space("so:3 x r:3")`. */
export class Space {
  #core;

  constructor(name) {
    if (typeof name !== "string") {
      throw new ValidationError(`space must be a name, such as "sphere:2", not ${String(name)}`, { argument: "space" });
    }
    this.name = name.trim();
    const names = this.name.split(" x ");
    if (names.length === 1) {
      this.#core = checked(() => new core.Space(name));
      this.factors = [this];
      this.pointShape = [...this.#core.pointShape];
      this.length = this.pointShape.reduce((a, b) => a * b, 1);
      this.dim = this.#core.dim;
      this.injectivityRadius = this.#core.injectivityRadius;
      return;
    }
    this.factors = names.map((factor) => new Space(factor));
    this.pointShape = this.factors.map((factor) => factor.pointShape);
    this.length = sum(this.factors.map((factor) => factor.length));
    this.dim = sum(this.factors.map((factor) => factor.dim));
    this.injectivityRadius = Math.min(...this.factors.map((factor) => factor.injectivityRadius));
  }

  /** The names of all spaces that are not products. */
  static get names() {
    return checked(() => core.Space.names()).split(" ");
  }

  exp(p, v) {
    return this._whole(this.#each({ p, v }, (of, p, v) => of.exp(p, v)));
  }

  log(p, q) {
    return this._whole(this.#each({ p, q }, (of, p, q) => of.log(p, q)));
  }

  distance(p, q) {
    return Math.hypot(...this.#each({ p, q }, (of, p, q) => of.distance(p, q)[0]));
  }

  inner(p, u, v) {
    return sum(this.#each({ p, u, v }, (of, p, u, v) => of.inner(p, u, v)[0]));
  }

  norm(p, v) {
    return Math.sqrt(Math.max(0, this.inner(p, v, v)));
  }

  project(x) {
    return this._whole(this.#each({ x }, (of, x) => of.project(x)));
  }

  geodesic(p, q, t) {
    const one = typeof t === "number";
    const times = one ? Float64Array.of(t) : vector(t, "t");
    const found = this.#each({ p, q }, (of, p, q) => of.geodesic(p, q, times));
    return this._whole(found.map((numbers, k) => (one ? numbers : cut(numbers, this.factors[k])[0])));
  }

  /** The value in each factor of a product, or that of the only factor. */
  _whole(values) {
    return this.factors.length === 1 ? values[0] : values;
  }

  /** Calls a function of the compiled module for each factor, with the numbers of the arguments in it. */
  #each(inputs, call) {
    const parts = Object.entries(inputs).map(([argument, x]) =>
      inFactors(x, this, argument, (part, factor) => Float64Array.from(row(part, factor.length, argument))));
    return forFactors(this, (factor, k) => checked(() => call(factor.#core, ...parts.map((part) => part[k]))));
  }
}

function sum(numbers) {
  return numbers.reduce((a, b) => a + b);
}

/** Views of the rows of an array, in each factor. */
function cut(numbers, space) {
  let stop = 0;
  return space.factors.map(({ length }) => {
    const start = stop;
    stop += length;
    const row = (_, i) => numbers.subarray(i * space.length + start, i * space.length + start + length);
    return Array.from({ length: numbers.length / space.length }, row);
  });
}

/** What all curves have in common. */
class Curve {
  #core;
  #t;
  // Points and velocities at the knots, in each factor.
  #rows = {};

  constructor(space, fit) {
    this.space = space;
    this.#core = checked(fit);
  }

  get t() {
    return (this.#t ??= this.#core.t);
  }

  get points() {
    return this.space._whole(this.#atKnots("points"));
  }

  get velocities() {
    return this.space._whole(this.#atKnots("velocities"));
  }

  get domain() {
    return [this.t[0], this.t[this.t.length - 1]];
  }

  get report() {
    const [iterations, residual, maxStep] = this.#core.report;
    return { iterations, residual, maxStep, method: this.#core.solver };
  }

  /** The control points of each segment, a cubic Bézier curve: see (8) and (12) of the paper. */
  get controlPoints() {
    const { t, space } = this;
    const inFactor = (factor, k) => {
      const [points, velocities] = [this.#atKnots("points")[k], this.#atKnots("velocities")[k]];
      return Array.from({ length: t.length - 1 }, (_, i) => {
        const third = (t[i + 1] - t[i]) / 3;
        const handle = (node, sign) => factor.exp(points[node], velocities[node].map((u) => sign * third * u));
        return [points[i], handle(i, 1), handle(i + 1, -1), points[i + 1]];
      });
    };
    return space._whole(space.factors.map(inFactor));
  }

  evaluate(x, nu = 0) {
    const one = typeof x === "number";
    const found = cut(this.#numbers(one ? Float64Array.of(x) : vector(x, "x"), nu), this.space);
    return this.space._whole(one ? found.map(([row]) => row) : found);
  }

  evaluateInto(x, out, nu = 0) {
    const times = vector(x, "x");
    const arrays = inFactors(out, this.space, "out", (array, { length }) => {
      const expected = times.length * length;
      if (array instanceof Float64Array && array.length === expected) return array;
      const message = `out must be a Float64Array of ${expected} numbers, one point per time`;
      throw new ValidationError(message, { argument: "out", value: array?.length ?? null, limit: expected });
    });
    const numbers = this.#numbers(times, nu);
    if (arrays.length === 1) arrays[0].set(numbers);
    else cut(numbers, this.space).forEach((rows, k) => rows.forEach((row, i) => arrays[k].set(row, i * row.length)));
    return out;
  }

  /** Releases the memory of the curve, which otherwise is done some time after its last use. */
  free() {
    this.#core.free();
  }

  #atKnots(quantity) {
    return (this.#rows[quantity] ??= cut(this.#core[quantity], this.space));
  }

  #numbers(x, nu) {
    if (nu !== 0 && nu !== 1 && nu !== 2) {
      throw new ValidationError(`nu must be 0, 1 or 2, not ${String(nu)}`, { argument: "nu" });
    }
    return checked(() => this.#core.evaluate(x, nu));
  }

  _core() {
    return this.#core;
  }
}

const METHODS = ["auto", "fixed-point", "quasi-newton", "newton", "homotopy"];

/** A C² cubic spline through points. */
export class CubicSpline extends Curve {
  constructor(t, points, space, options = {}) {
    known(options, ["bcType", "method", "tol", "extrapolate", "atol"]);
    const { bcType = "natural", method = "auto", tol = 1e-12, extrapolate, atol = 1e-8 } = options;
    const of = asSpace(space);
    const numbers = joinedRows(points, of);
    super(of, () =>
      core.Spline.fit(
        times(t, numbers.length / of.length), numbers, of.name, ends(bcType, of),
        word(method, "method", METHODS), number(tol, "tol"), number(atol, "atol"), policy(extrapolate),
      ));
    this.bcType = bcType;
  }
}

/** A C² cubic spline close to noisy points. */
export class SmoothingSpline extends Curve {
  get lam() {
    return this.#property(0);
  }

  get df() {
    return this.#property(1);
  }

  get sigma() {
    return this.#property(2);
  }

  std(x) {
    const one = typeof x === "number";
    const found = checked(() => this._core().std(one ? Float64Array.of(x) : vector(x, "x")));
    const count = this.space.factors.length;
    const inFactor = (_, k) => (one ? found[k] : found.filter((_, i) => i % count === k));
    return this.space._whole(this.space.factors.map(inFactor));
  }

  band(x, level = 0.95) {
    if (!(number(level, "level") > 0 && level < 1)) {
      throw new ValidationError(`level must lie between 0 and 1, not ${level}`, { argument: "level", value: level });
    }
    const all = this.std(x);
    const inFactor = ({ dim }, k) => {
      const radius = core.ballRadius(dim, level);
      const std = this.space.factors.length === 1 ? all : all[k];
      return typeof x === "number" ? radius * std : std.map((s) => radius * s);
    };
    return this.space._whole(this.space.factors.map(inFactor));
  }

  /** A number of the report, in each factor. */
  #property(index) {
    const numbers = this._core().smoothing;
    return this.space._whole(this.space.factors.map((_, k) => numbers[4 * k + index]));
  }
}

const SMOOTHING = ["lam", "weights", "knots", "sigma", "gamma", "loss", "bcType", "extrapolate", "atol"];

/** Fits a curve close to noisy points. */
export function makeSmoothingSpline(t, points, space, options = {}) {
  known(options, SMOOTHING);
  const { lam, weights, knots, sigma, gamma = 1.2, loss = "linear", bcType = "natural", extrapolate, atol = 1e-8 } = options;
  const of = asSpace(space);
  const numbers = joinedRows(points, of);
  const list = (x, argument) => (x === undefined || x === null ? undefined : vector(x, argument));
  return new SmoothingSpline(of, () =>
    core.Spline.smooth(
      times(t, numbers.length / of.length), numbers, of.name, perFactor(lam, "lam", of),
      list(weights, "weights"), list(knots, "knots"), perFactor(sigma, "sigma", of), number(gamma, "gamma"),
      word(loss, "loss", ["linear", "huber", "cauchy"]), word(bcType, "bcType", ["natural", "periodic"]) === "periodic",
      number(atol, "atol"), policy(extrapolate),
    ));
}

function asSpace(space) {
  return space instanceof Space ? space : new Space(space);
}

function times(t, count) {
  return t === null || t === undefined ? Float64Array.from({ length: count }, (_, i) => i) : vector(t, "t");
}

function policy(extrapolate) {
  if (extrapolate === true) return "segment";
  return word(extrapolate ?? "raise", "extrapolate", ["raise", "geodesic", "periodic"]);
}

const NONE = new Float64Array(0);

/** End conditions as in SciPy: a word, or a pair with a word, [1, velocity] or [2, acceleration] per end. */
function ends(bcType, space) {
  if (bcType === "periodic") return core.Ends.periodic();
  const pair = Array.isArray(bcType) ? bcType : [bcType, bcType];
  if (pair.length !== 2) {
    throw new ValidationError("bcType must be a word, or a pair with one condition per end", { argument: "bcType" });
  }
  return core.Ends.open(space.name, ...pair.flatMap((end, index) => oneEnd(end, index, space)));
}

function oneEnd(end, index, space) {
  if (end === "clamped") return ["velocity", new Float64Array(space.length)];
  if (end === "natural" || end === "not-a-knot") return [end, NONE];
  if (Array.isArray(end) && end.length === 2 && (end[0] === 1 || end[0] === 2)) {
    const kind = end[0] === 1 ? "velocity" : "acceleration";
    return [kind, joinedRow(end[1], space, "bcType", index)];
  }
  const message =
    "bcType must be \"natural\", \"clamped\", \"not-a-knot\" or \"periodic\", or a pair with \"natural\", \"clamped\", " +
    "\"not-a-knot\", [1, velocity] or [2, acceleration] for either end";
  throw new ValidationError(message, { argument: "bcType", index });
}
