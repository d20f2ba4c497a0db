// Smooth curves through points of curved spaces. The compiled module does the arithmetic; this file reads its input.

import { checked as converted, ConvergenceError, CutLocusError, SymsplineError, ValidationError } from "./errors.js";
import { known, number, optional, row, rows, vector, word } from "./input.js";
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

/** A space, such as `new Space("sphere:2")`. */
export class Space {
  #core;

  constructor(name) {
    if (typeof name !== "string") {
      throw new ValidationError(`space must be a name, such as "sphere:2", not ${String(name)}`, { argument: "space" });
    }
    const [word, sizes] = nameAndSizes(name);
    this.#core = checked(() => new core.Space(word, sizes));
    this.name = name;
    this.pointShape = [...this.#core.pointShape];
    this.dim = this.#core.dim;
    this.injectivityRadius = this.#core.injectivityRadius;
    this.length = this.pointShape.reduce((a, b) => a * b, 1);
  }

  /** The names of all spaces. */
  static get names() {
    return checked(() => core.Space.names()).split(" ");
  }

  exp(p, v) {
    return checked(() => this.#core.exp(this.#row(p), this.#row(v, "v")));
  }

  log(p, q) {
    return checked(() => this.#core.log(this.#row(p), this.#row(q, "q")));
  }

  distance(p, q) {
    return checked(() => this.#core.distance(this.#row(p), this.#row(q, "q")))[0];
  }

  inner(p, u, v) {
    return checked(() => this.#core.inner(this.#row(p), this.#row(u, "u"), this.#row(v, "v")))[0];
  }

  norm(p, v) {
    return Math.sqrt(Math.max(0, this.inner(p, v, v)));
  }

  project(x) {
    return checked(() => this.#core.project(this.#row(x, "x")));
  }

  geodesic(p, q, t) {
    const one = typeof t === "number";
    const times = one ? Float64Array.of(t) : vector(t, "t");
    const found = checked(() => this.#core.geodesic(this.#row(p), this.#row(q, "q"), times));
    return one ? found : cut(found, this.length);
  }

  #row(x, argument = "p") {
    return Float64Array.from(row(x, this.length, argument));
  }
}

/** "gr:2,5" is the name "gr" with the sizes 2 and 5. */
function nameAndSizes(name) {
  const [word, sizes = ""] = name.trim().toLowerCase().split(":");
  const numbers = sizes === "" ? [] : sizes.split(",").map(Number);
  if (!numbers.every((n) => Number.isInteger(n) && n >= 0 && n < 2 ** 24)) {
    throw new ValidationError(`the sizes of the space ${JSON.stringify(name)} must be whole numbers`, { argument: "space" });
  }
  return [word, Uint32Array.from(numbers)];
}

/** Views of the rows of an array. */
function cut(numbers, length) {
  return Array.from({ length: numbers.length / length }, (_, i) => numbers.subarray(i * length, (i + 1) * length));
}

/** What all curves have in common. */
class Curve {
  #core;
  #rows = {};

  constructor(space, fit) {
    this.space = space;
    this.#core = checked(fit);
  }

  get t() {
    return (this.#rows.t ??= this.#core.t);
  }

  get points() {
    return (this.#rows.points ??= cut(this.#core.points, this.space.length));
  }

  get velocities() {
    return (this.#rows.velocities ??= cut(this.#core.velocities, this.space.length));
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
    const { t, points, velocities, space } = this;
    return Array.from({ length: t.length - 1 }, (_, i) => {
      const third = (t[i + 1] - t[i]) / 3;
      const handle = (node, sign) => space.exp(points[node], velocities[node].map((u) => sign * third * u));
      return [points[i], handle(i, 1), handle(i + 1, -1), points[i + 1]];
    });
  }

  evaluate(x, nu = 0) {
    if (typeof x === "number") return this.#numbers(Float64Array.of(x), nu);
    return cut(this.#numbers(vector(x, "x"), nu), this.space.length);
  }

  evaluateInto(x, out, nu = 0) {
    const times = vector(x, "x");
    const expected = times.length * this.space.length;
    if (!(out instanceof Float64Array) || out.length !== expected) {
      const message = `out must be a Float64Array of ${expected} numbers, one point per time`;
      throw new ValidationError(message, { argument: "out", value: out?.length ?? null, limit: expected });
    }
    out.set(this.#numbers(times, nu));
    return out;
  }

  /** Releases the memory of the curve, which otherwise is done some time after its last use. */
  free() {
    this.#core.free();
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
    const numbers = rows(points, of.length);
    super(of, () =>
      core.Spline.fit(
        times(t, numbers.length / of.length), numbers, ...nameAndSizes(of.name), ends(bcType, of),
        word(method, "method", METHODS), number(tol, "tol"), number(atol, "atol"), policy(extrapolate),
      ));
    this.bcType = bcType;
  }
}

/** A C² cubic spline close to noisy points. */
export class SmoothingSpline extends Curve {
  get lam() {
    return this._core().smoothing[0];
  }

  get df() {
    return this._core().smoothing[1];
  }

  get sigma() {
    return this._core().smoothing[2];
  }

  std(x) {
    const found = checked(() => this._core().std(typeof x === "number" ? Float64Array.of(x) : vector(x, "x")));
    return typeof x === "number" ? found[0] : found;
  }

  band(x, level = 0.95) {
    if (!(number(level, "level") > 0 && level < 1)) {
      throw new ValidationError(`level must lie between 0 and 1, not ${level}`, { argument: "level", value: level });
    }
    const radius = core.ballRadius(this.space.dim, level);
    const std = this.std(x);
    return typeof x === "number" ? radius * std : std.map((s) => radius * s);
  }
}

const SMOOTHING = ["lam", "weights", "knots", "sigma", "gamma", "loss", "bcType", "extrapolate", "atol"];

/** Fits a curve close to noisy points. */
export function makeSmoothingSpline(t, points, space, options = {}) {
  known(options, SMOOTHING);
  const { lam, weights, knots, sigma, gamma = 1.2, loss = "linear", bcType = "natural", extrapolate, atol = 1e-8 } = options;
  const of = asSpace(space);
  const numbers = rows(points, of.length);
  const list = (x, argument) => (x === undefined || x === null ? undefined : vector(x, argument));
  return new SmoothingSpline(of, () =>
    core.Spline.smooth(
      times(t, numbers.length / of.length), numbers, ...nameAndSizes(of.name), optional(lam, "lam"),
      list(weights, "weights"), list(knots, "knots"), optional(sigma, "sigma"), number(gamma, "gamma"),
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
  return core.Ends.open(...pair.flatMap((end, index) => oneEnd(end, index, space)));
}

function oneEnd(end, index, space) {
  if (end === "clamped") return ["velocity", new Float64Array(space.length)];
  if (end === "natural" || end === "not-a-knot") return [end, NONE];
  if (Array.isArray(end) && end.length === 2 && (end[0] === 1 || end[0] === 2)) {
    const kind = end[0] === 1 ? "velocity" : "acceleration";
    return [kind, Float64Array.from(row(end[1], space.length, "bcType", index))];
  }
  const message =
    "bcType must be \"natural\", \"clamped\", \"not-a-knot\" or \"periodic\", or a pair with \"natural\", \"clamped\", " +
    "\"not-a-knot\", [1, velocity] or [2, acceleration] for either end";
  throw new ValidationError(message, { argument: "bcType", index });
}
