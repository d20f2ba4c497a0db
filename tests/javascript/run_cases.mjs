// Runs the cases of a JSON file with the npm package, and prints the results as JSON.
// node run_cases.mjs PACKAGE CASES

import { readFile } from "node:fs/promises";
import { pathToFileURL } from "node:url";

const [folder, file] = process.argv.slice(2);
const symspline = await import(pathToFileURL(`${folder}/index.js`));
await symspline.init();

/** Results as nested arrays: of a product, one per factor. */
const plain = (found) => (ArrayBuffer.isView(found) ? [...found] : Array.isArray(found) ? found.map(plain) : found);

function number(x) {
  return typeof x === "string" ? Number(x) : x;
}

/** NaN and infinities, which JSON lacks, are text. */
function revive(x) {
  if (Array.isArray(x)) return x.map(revive);
  return ["NaN", "Infinity", "-Infinity"].includes(x) ? number(x) : x;
}

const KINDS = {
  spline({ t, points, space, options = {}, x }) {
    const spline = new symspline.CubicSpline(revive(t), revive(points), space, revive(options));
    const outs = spline.space.factors.map(({ length }) => new Float64Array(x.length * length));
    return {
      values: [0, 1, 2].map((nu) => plain(spline.evaluate(x, nu))),
      into: plain(spline.evaluateInto(x, outs.length === 1 ? outs[0] : outs, 1)),
      one: plain(spline.evaluate(x[1])),
      points: plain(spline.points),
      velocities: plain(spline.velocities),
      controlPoints: plain(spline.controlPoints),
      report: spline.report,
    };
  },
  smooth({ t, points, space, options = {}, x }) {
    const smooth = symspline.makeSmoothingSpline(t, points, space, options);
    const { lam, df, sigma } = smooth;
    const [std, band] = [smooth.std(x), smooth.band(x, 0.9)].map(plain);
    return { values: plain(smooth.evaluate(x)), std, band, one: smooth.std(x[1]), lam, df, sigma };
  },
  space({ space, p, q, v, t }) {
    const on = new symspline.Space(space);
    return {
      exp: plain(on.exp(p, v)), log: plain(on.log(p, q)), distance: on.distance(p, q), inner: on.inner(p, v, v),
      norm: on.norm(p, v), project: plain(on.project(p)), geodesic: plain(on.geodesic(p, q, t)),
      middle: plain(on.geodesic(p, q, 0.5)), dim: on.dim, shape: on.pointShape, radius: String(on.injectivityRadius),
      factors: on.factors.map(({ name }) => name),
    };
  },
  evaluate({ x, nu, options = {} }) {
    const square = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    return { values: plain(new symspline.CubicSpline(null, square, "sphere:2", options).evaluate(revive(x), nu)) };
  },
};

function run(entry) {
  try {
    return KINDS[entry.kind](entry);
  } catch (error) {
    if (!(error instanceof symspline.SymsplineError)) throw error;
    const { name, message, argument, index, value, limit, factor } = error;
    return { error: name, message, argument, index, value, limit, factor };
  }
}

const cases = JSON.parse(await readFile(file, "utf8"));
process.stdout.write(JSON.stringify(cases.map(run)));
