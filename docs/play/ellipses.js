// Covariance matrices, drawn as ellipses.

import { CubicSpline, Space } from "symspline";
import { Chart } from "./chart.js";
import { assign } from "./code.js";
import { ARROWS, SAMPLES } from "./figure.js";
import { dot as mark, nearest } from "./stage.js";
import { clamp, linspace, rounded } from "./vectors.js";

/** Half axes and the angle of the first one. */
const START = { t: [0, 1, 2, 3, 4], shapes: [[1, 0.25, 0.1], [0.9, 0.3, 0.9], [1, 0.2, 2.0], [0.5, 0.45, 2.4], [1, 0.3, 3.4]] };
const SHORTEST = 0.08;
const LONGEST = 1.15;

/** The matrix R diag(a², b²) Rᵀ, with four digits after the point. */
function matrix([a, b, angle]) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const off = rounded((a * a - b * b) * c * s, 4);
  return [rounded(a * a * c * c + b * b * s * s, 4), off, off, rounded(a * a * s * s + b * b * c * c, 4)];
}

/** Half axes and angle of a matrix; NaN if it is not positive definite. */
function shape([xx, xy, , yy]) {
  const [mean, half] = [(xx + yy) / 2, Math.hypot((xx - yy) / 2, xy)];
  return [Math.sqrt(mean + half), Math.sqrt(mean - half), 0.5 * Math.atan2(2 * xy, xx - yy)];
}

export class Ellipses {
  constructor(figure) {
    this.figure = figure;
    this.space = new Space("spd:2");
    this.chart = new Chart({ figure });
    this.question = "Make two neighbouring ellipses narrow and perpendicular. What happens to the area between them?";
    this.text =
      "An ellipse stands for a covariance matrix, or for a diffusion tensor in a medical image. The solid ellipses follow the spline of " +
      "SPD(2), for which volume is as natural as length: it does not swell between equal areas. The dotted ones come from cubic splines of " +
      "the three matrix entries, which swell, and can even stop being ellipses.";
  }

  setUp() {
    this.t = [...START.t];
    this.shapes = START.shapes.map((s) => [...s]);
    this.ends = "natural";
  }

  fit() {
    const { t, ends } = this;
    this.points = this.shapes.map(matrix);
    this.spline = new CubicSpline(t, this.points, this.space, { bcType: ends });
    this.naive = new CubicSpline(t, this.points, "r:4", { bcType: ends });
    this.x = linspace(t[0], t[t.length - 1], SAMPLES);
    const area = ([a, b]) => Math.PI * a * b;
    const ratio = ([a, b]) => a / b;
    const [own, naive] = [this.spline, this.naive].map((curve) => curve.evaluate(this.x).map(shape));
    this.area = [own.map(area), naive.map(area)];
    this.ratio = [own.map(ratio), naive.map(ratio)];
  }

  layout({ width, height }) {
    if (width > 720) {
      const w = width * 0.56;
      return {
        main: [w / 2, height * 0.36, Math.min(w * 0.3, height * 0.29)], strip: [8, w - 16, height - 78],
        chart: { x: w + 18, y: 12, width: width - w - 22, height: height - 18 },
      };
    }
    return { main: [width / 2, 130, 100], strip: [0, width, 290], chart: { x: 0, y: 350, width, height: height - 354 } };
  }

  draw(context, stage) {
    const { figure, t } = this;
    const { colors } = stage;
    const { main, strip, chart } = this.layout(stage);
    if (!figure.error) {
      const x = clamp(figure.cursor, t[0], t.at(-1));
      const naive = shape(this.naive.evaluate(x));
      ellipse(context, main, naive, main[2], { stroke: colors.third, dash: [3, 4], width: 2 });
      ellipse(context, main, shape(this.spline.evaluate(x)), main[2], { fill: colors.band, stroke: colors.spline, width: 3.5 });
      const text = Number.isFinite(naive[1]) ? "" : "The entries form no ellipse at this time.";
      stage.text(text, main[0], main[1] + main[2] + 24, { align: "center", color: colors.third });
      this.trail(context, strip, colors);
    }
    const [left, width, y] = strip;
    const size = Math.min(38, width / this.points.length / 2.4);
    this.handles = [];
    this.shapes.forEach((own, i) => {
      const at = [left + ((t[i] - t[0]) / (t.at(-1) - t[0])) * (width - 2 * size) + size, y];
      const chosen = i === figure.selected;
      ellipse(context, at, own, size, { fill: chosen ? colors.accent : colors.paper, stroke: colors.ink, width: 1.8, alpha: chosen ? 0.45 : 1 });
      const [a, b, angle] = own;
      const tip = (length, turned) => [at[0] + size * length * Math.cos(turned), at[1] - size * length * Math.sin(turned)];
      this.handles.push({ at, size, tips: [tip(a, angle), tip(b, angle + Math.PI / 2)] });
      for (const place of this.handles[i].tips) mark(context, place, chosen ? 5 : 3, chosen ? colors.accent : colors.paper, colors.ink);
    });
    if (!figure.error) {
      const lines = (pair) => [
        { x: this.x, y: pair[1], color: colors.third, dash: [3, 4], ignore: true }, { x: this.x, y: pair[0], color: colors.spline, width: 2.5 },
      ];
      this.chart.draw(context, stage, chart, [{ title: "Area", lines: lines(this.area) }, { title: "Ratio of the axes", lines: lines(this.ratio) }]);
    }
  }

  /** Many ellipses of the curve behind those that can be changed. */
  trail(context, [left, width, y], colors) {
    const size = Math.min(38, width / this.points.length / 2.4);
    const [start, end] = this.spline.domain;
    const count = 33;
    this.spline.evaluate(linspace(start, end, count)).forEach((m, i) => {
      const at = [left + (i / (count - 1)) * (width - 2 * size) + size, y];
      ellipse(context, at, shape(m), size, { stroke: colors.spline, width: 0.8, alpha: 0.45 });
    });
  }

  remark() {
    const most = Math.max(...this.area[1].filter(Number.isFinite));
    return `Largest area: ${Math.max(...this.area[0]).toFixed(2)} along the spline, ${most.toFixed(2)} for the entries.`;
  }

  hit(x, y) {
    const tips = (this.handles ?? []).flatMap(({ tips: both }) => both);
    const found = nearest(tips, x, y, 14);
    if (found >= 0) {
      const [index, axis] = [found >> 1, found & 1];
      return { cursor: "move", move: (px, py) => this.pull(index, axis, px, py) };
    }
    const whole = nearest((this.handles ?? []).map(({ at }) => at), x, y, 36);
    if (whole >= 0) {
      this.figure.select(whole);
      return { cursor: "pointer", move: () => {}, end: () => this.figure.moveCursor(this.t[whole]) };
    }
    return this.chart.hit(x, y);
  }

  /** Moves the end of an axis; the axis follows the pointer in length and direction. */
  pull(index, axis, px, py) {
    const { at, size } = this.handles[index];
    const [u, v] = [(px - at[0]) / size, (at[1] - py) / size];
    this.figure.selected = index;
    const own = [...this.shapes[index]];
    own[axis] = clamp(Math.hypot(u, v), SHORTEST, LONGEST);
    own[2] = Math.atan2(v, u) - (axis * Math.PI) / 2;
    this.set(index, own);
    this.figure.moveCursor(this.t[index]);
  }

  set(index, own) {
    this.shapes[index] = [rounded(own[0], 3), rounded(own[1], 3), rounded(own[2], 3)];
    this.figure.changed();
  }

  arrow(key, times) {
    if (!ARROWS[key]) return false;
    const [right, up] = ARROWS[key];
    const [a, b, angle] = this.shapes[this.figure.selected];
    this.set(this.figure.selected, [clamp(a + 0.02 * up * times, SHORTEST, LONGEST), b, angle - 0.05 * right * times]);
    return true;
  }

  program() {
    const rows = this.points.map(([xx, xy, , yy]) => [[xx, xy], [xy, yy]]);
    return [
      "import numpy as np", "import symspline as ss", "", assign("t", [...this.t]), "# Covariance matrices.", assign("points", rows),
      `spline = ss.CubicSpline(t, points, "spd:2", bc_type="${this.ends}")`, "", "x = np.linspace(t[0], t[-1], 400)",
      "matrices = spline(x)", "areas = np.pi * np.sqrt(np.linalg.det(matrices))", "",
    ].join("\n");
  }
}

function ellipse(context, [x, y], [a, b, angle], size, { fill, stroke, width, dash = [], alpha = 1 }) {
  if (!(a > 0 && b > 0)) return;
  context.beginPath();
  context.ellipse(x, y, a * size, b * size, -angle, 0, 2 * Math.PI);
  if (fill) {
    context.globalAlpha = alpha;
    context.fillStyle = fill;
    context.fill();
  }
  context.globalAlpha = fill ? 1 : alpha;
  context.strokeStyle = stroke;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
}
