// States of a qubit on the Bloch sphere, and the field that drives them along the curve.

import { CubicSpline, Space } from "symspline";
import { Ball } from "./ball.js";
import { Chart } from "./chart.js";
import { assign } from "./code.js";
import { ARROWS, SAMPLES } from "./figure.js";
import { dot as mark, line, nearest } from "./stage.js";
import { clamp, cross, dot, fromLonlat, linspace, norm, plus, scaled, toLonlat, unit } from "./vectors.js";

const START = { t: [0, 2, 3.5, 5, 7], angles: [[0, 90], [-20, 40], [60, 20], [80, -25], [0, -90]] };
const NAMES = ["x", "y", "z"];
const STEP = Math.PI / 90;

export class Bloch {
  constructor(figure) {
    this.figure = figure;
    this.space = new Space("sphere:2");
    this.ball = new Ball(20, 18);
    this.chart = new Chart({ figure });
    this.question = "Bring two neighbouring states closer together in space or in time. Which part of the pulse grows?";
    this.text =
      "Points of the Bloch sphere are pure states of a qubit. The curve passes through all of them, and the graphs show the " +
      "magnetic field of least strength that drives a spin along it, B = r × r′ (solid lines). Along geodesics the " +
      "field is constant and jumps at every state (dashed lines). The hardware must follow these jumps.";
  }

  setUp() {
    this.t = [...START.t];
    this.angles = START.angles.map((a) => [...a]);
    this.ends = "natural";
    this.ball.look(28, 16);
  }

  fit() {
    const { t, space } = this;
    this.points = this.angles.map(fromLonlat);
    this.spline = new CubicSpline(t, this.points, space, { bcType: this.ends });
    this.x = linspace(t[0], t[t.length - 1], SAMPLES);
    this.line = this.spline.evaluate(this.x);
    const velocity = this.spline.evaluate(this.x, 1);
    this.field = this.line.map((r, i) => cross(r, velocity[i]));
    const steps = this.points.slice(1).map((q, i) => scaled(space.log(this.points[i], q), 1 / (t[i + 1] - t[i])));
    const constant = steps.map((v, i) => cross(this.points[i], v));
    this.pieces = [...this.x].map((x) => {
      const i = t.findIndex((time) => time > x) - 1;
      return constant[i < 0 ? t.length - 2 : i];
    });
    this.polygon = this.points.slice(1).flatMap((q, i) => space.geodesic(this.points[i], q, linspace(0, 1, 40)));
  }

  layout({ width, height }) {
    if (width > 720) {
      const size = Math.min(height, width * 0.52);
      return { ball: [size / 2, height / 2, size / 2 - 34], chart: { x: size + 18, y: 12, width: width - size - 22, height: height - 18 } };
    }
    const radius = Math.min(width / 2 - 34, height * 0.26);
    return { ball: [width / 2, radius + 30, radius], chart: { x: 0, y: 2 * radius + 66, width, height: height - 2 * radius - 70 } };
  }

  draw(context, stage) {
    const { figure, ball } = this;
    const { colors } = stage;
    const { ball: place, chart } = this.layout(stage);
    ball.place(...place);
    mark(context, [ball.x, ball.y], ball.radius, colors.sea, colors.coast, 1);
    const circle = (lat, lon) =>
      Array.from({ length: 73 }, (_, i) => fromLonlat(lon === undefined ? [5 * i, lat] : [i < 37 ? lon : lon + 180, i < 37 ? 5 * i - 90 : 270 - 5 * i]));
    for (const points of [circle(0), circle(0, 0), circle(0, 90)]) this.stroke(context, points, colors.coast, 0.8);
    for (const [state, vector] of Object.entries({ "|0⟩": [0, 0, 1], "|1⟩": [0, 0, -1], "|+⟩": [1, 0, 0] })) {
      const [x, y, depth] = ball.project(scaled(vector, 1.09));
      stage.text(state, x, y, { align: "center", size: 13, color: depth > 0 ? colors.ink : colors.muted });
    }
    if (!figure.error) {
      this.stroke(context, this.polygon, colors.other, 1.6, [6, 5]);
      this.stroke(context, this.line, colors.spline, 3.5);
      this.arrow3d(context, stage);
    }
    this.places = this.points.map((p) => {
      const [x, y, depth] = ball.project(p);
      return depth > -0.05 ? [x, y] : null;
    });
    this.places.forEach((at, i) => {
      if (at) mark(context, at, i === figure.selected ? 8 : 6.5, i === figure.selected ? colors.accent : colors.paper, colors.ink, 1.8);
    });
    if (!figure.error) this.chart.draw(context, stage, chart, this.panels(colors));
  }

  stroke(context, points, color, width, dash) {
    const { near, far } = this.ball.split(points);
    context.globalAlpha = 0.25;
    line(context, far, color, width, dash);
    context.globalAlpha = 1;
    line(context, near, color, width, dash);
  }

  /** The state and its field at the cursor. */
  arrow3d(context, stage) {
    const { ball } = this;
    const { colors } = stage;
    const x = clamp(this.figure.cursor, this.t[0], this.t.at(-1));
    const r = this.spline.evaluate(x);
    const field = cross(r, this.spline.evaluate(x, 1));
    const most = Math.max(...this.field.map(norm));
    const center = [ball.x, ball.y];
    const arrow = (vector, color, width) => {
      const [tx, ty] = ball.project(vector);
      const length = Math.hypot(tx - center[0], ty - center[1]);
      line(context, [center, [tx, ty]], color, width);
      if (length < 8) return;
      const [ux, uy] = [(tx - center[0]) / length, (ty - center[1]) / length];
      line(context, [[tx - 9 * ux - 5 * uy, ty - 9 * uy + 5 * ux], [tx, ty], [tx - 9 * ux + 5 * uy, ty - 9 * uy - 5 * ux]], color, width);
    };
    arrow([...r], colors.spline, 2);
    arrow(scaled(field, 0.8 / most), colors.ink, 2.5);
    const [bx, by] = ball.project(scaled(field, 0.9 / most));
    stage.text("B", bx, by, { align: "center", color: colors.ink, weight: 600, size: 13 });
  }

  panels(colors) {
    return NAMES.map((name, k) => ({
      title: `Field B${name}`, signed: true,
      lines: [
        { x: this.x, y: this.pieces.map((b) => b[k]), color: colors.other, dash: [7, 5] },
        { x: this.x, y: this.field.map((b) => b[k]), color: colors.spline, width: 2.5 },
      ],
    }));
  }

  remark() {
    const most = Math.max(...this.field.map(norm));
    return `Strongest field: ${most.toFixed(2)} radians per unit of time along the spline.`;
  }

  hit(x, y) {
    const found = nearest(this.places ?? [], x, y, 20);
    if (found >= 0) {
      this.figure.select(found);
      return { cursor: "move", move: (px, py) => this.move(found, this.ball.unproject(px, py)) };
    }
    return this.ball.contains(x, y) ? this.ball.grab(x, y) : this.chart.hit(x, y);
  }

  move(index, point) {
    this.angles[index] = toLonlat(point);
    this.figure.changed();
  }

  arrow(key, times) {
    if (!ARROWS[key]) return false;
    const [right, up] = ARROWS[key].map((s) => s * times * STEP);
    const { view } = this.ball;
    const p = this.points[this.figure.selected];
    const step = plus(scaled(view.slice(0, 3), right), scaled(view.slice(3, 6), up));
    this.move(this.figure.selected, unit(plus(p, plus(step, scaled(p, -dot(step, p))))));
    return true;
  }

  program() {
    return [
      "import numpy as np", "import symspline as ss", "", "# Azimuth and elevation on the Bloch sphere in degrees.",
      assign("t", [...this.t]), assign("azimuth", this.angles.map((a) => a[0])), assign("elevation", this.angles.map((a) => a[1])),
      "vectors = ss.geo.from_lonlat(azimuth, elevation)", "states = ss.quantum.from_bloch_vector(vectors)",
      `spline = ss.CubicSpline(t, states, "cp:1", bc_type="${this.ends}")`, "", "x = np.linspace(t[0], t[-1], 400)",
      "vectors = ss.quantum.bloch_vector(spline(x))", "H = ss.quantum.hamiltonian(spline, x)  # H = B·σ/2", "",
    ].join("\n");
  }
}
