// Runs the cases of a JSON file with the npm package, and prints the results as JSON.
// node run_cases.mjs PACKAGE CASES

import { readFile } from "node:fs/promises";
import { pathToFileURL } from "node:url";

const [folder, file] = process.argv.slice(2);
const symspline = await import(pathToFileURL(`${folder}/index.js`));
await symspline.init();

const rows = (found) => found.map((row) => [...row]);

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
    const into = spline.evaluateInto(x, new Float64Array(x.length * spline.space.length), 1);
    return {
      values: [0, 1, 2].map((nu) => rows(spline.evaluate(x, nu))),
      into: [...into],
      velocities: rows(spline.velocities),
      controlPoints: spline.controlPoints.map(rows),
      report: spline.report,
    };
  },
  smooth({ t, points, space, options = {}, x }) {
    const smooth = symspline.makeSmoothingSpline(t, points, space, options);
    const { lam, df, sigma } = smooth;
    return { values: rows(smooth.evaluate(x)), std: [...smooth.std(x)], band: [...smooth.band(x, 0.9)], lam, df, sigma };
  },
  space({ space, p, q, v, t }) {
    const on = new symspline.Space(space);
    return {
      exp: [...on.exp(p, v)], log: [...on.log(p, q)], distance: on.distance(p, q), inner: on.inner(p, v, v),
      project: [...on.project(p)], geodesic: rows(on.geodesic(p, q, t)), dim: on.dim, shape: on.pointShape,
      radius: String(on.injectivityRadius),
    };
  },
  evaluate({ x, nu, options = {} }) {
    const square = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    return { values: rows(new symspline.CubicSpline(null, square, "sphere:2", options).evaluate(revive(x), nu)) };
  },
};

function run(entry) {
  try {
    return KINDS[entry.kind](entry);
  } catch (error) {
    if (!(error instanceof symspline.SymsplineError)) throw error;
    const { name, message, argument, index, value, limit } = error;
    return { error: name, message, argument, index, value, limit };
  }
}

const cases = JSON.parse(await readFile(file, "utf8"));
process.stdout.write(JSON.stringify(cases.map(run)));
