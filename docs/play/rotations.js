// Figure 2: an aeroplane that turns along a spline, along Slerp, and along Euler angles.

import { CubicSpline, Space } from "symspline";
import { CAMERA, drawAeroplane } from "./aeroplane.js";
import { Chart } from "./chart.js";
import { assign } from "./code.js";
import { ARROWS, Figure } from "./figure.js";
import { between, clamp, linspace, norm, plus, product, rounded, scaled, transposed, turn, turnVector } from "./vectors.js";

/** Yaw, pitch and roll in radians. */
const START = { t: [0, 1, 2.2, 3, 4.2], angles: [[0, 0.1, 0], [0.7, -0.4, -0.6], [1.5, 0.8, 0.2], [2.1, 0.2, 0.8], [2.9, -0.3, 0]] };
const DEGREES = 180 / Math.PI;
/** Samples of rotations take longer than those of other figures. */
const SAMPLES = 240;
/** A pitch of 100°, which yaw, pitch and roll write as 80°, with yaw and roll turned by 180°. */
const PAST = 100 / DEGREES;

/** The rotation with yaw, pitch and roll: about z, then the new −y (nose up), then the new x. */
const fromAngles = ([yaw, pitch, roll]) => product(turn([0, 0, yaw]), product(turn([0, -pitch, 0]), turn([roll, 0, 0])));

/** Yaw, pitch and roll, with yaw and roll as close as possible to those before, as a flight recorder would unwrap them. */
function toAngles(m, before) {
  const found = [Math.atan2(m[3], m[0]), Math.asin(clamp(m[6], -1, 1)), Math.atan2(m[7], m[8])];
  return found.map((angle, i) => (before && i !== 1 ? angle - 2 * Math.PI * Math.round((angle - before[i]) / (2 * Math.PI)) : angle));
}

export class Rotations extends Figure {
  constructor(root) {
    super(root);
    this.on("ends", (value) => {
      this.ends = value;
    });
    this.control("up")?.addEventListener("click", () => {
      const [yaw, , roll] = toAngles(this.points[this.selected]);
      this.set(this.selected, fromAngles([yaw, PAST, roll]));
      this.toKnot();
    });
  }

  setUp() {
    this.space ??= new Space("so:3");
    this.chart ??= new Chart({ figure: this });
    this.t = [...START.t];
    this.vectors = START.angles.map((angles) => write(fromAngles(angles)));
    this.selected = 2;
    this.ends = "natural";
    if (this.control("ends")) this.control("ends").value = this.ends;
  }

  // ---- curves ----

  fit() {
    const { t, ends } = this;
    this.points = this.vectors.map(turn);
    this.spline = new CubicSpline(t, this.points, this.space, { bcType: ends });
    this.x = linspace(t[0], t[t.length - 1], SAMPLES);
    const at = this.spline.evaluate(this.x);
    const body = (nu) => this.spline.evaluate(this.x, nu).map((v, i) => DEGREES * norm(rate(at[i], v)));
    this.motion = [body(1), body(2)];
    this.steps = this.points.slice(1).map((q, i) => scaled(rate(this.points[i], this.space.log(this.points[i], q)), 1 / (t[i + 1] - t[i])));
    const fastest = Math.max(...this.steps.map(norm));
    this.slerp = {
      speed: [...this.x].map((x) => DEGREES * norm(this.steps[this.segment(x)])),
      jumps: this.steps.slice(1).map((after, i) => [t[i + 1], norm(plus(after, scaled(this.steps[i], -1))) / fastest]),
    };
    let before;
    const angles = this.points.map((m) => (before = toAngles(m, before)));
    this.euler = new CubicSpline(t, angles, "r:3", { bcType: ends });
    this.eulerMotion = this.eulerRates();
  }

  segment(x) {
    const i = this.t.findIndex((time) => time > x) - 1;
    return i < 0 ? this.t.length - 2 : i;
  }

  /** Length of the angular velocity of the Euler angles, and of its derivative by differences. */
  eulerRates() {
    const [at, first] = [0, 1].map((nu) => this.euler.evaluate(this.x, nu));
    const rates = at.map(([, pitch, roll], i) => {
      const [yaw, up, turned] = first[i];
      // Pitch is about −y here, hence the signs.
      const [c, s, cp, sp] = [Math.cos(roll), Math.sin(roll), Math.cos(pitch), Math.sin(pitch)];
      return [turned + yaw * sp, -up * c + yaw * cp * s, up * s + yaw * cp * c];
    });
    const step = this.x[1] - this.x[0];
    const derivative = rates.slice(1).map((r, i) => (DEGREES * norm(plus(r, scaled(rates[i], -1)))) / step);
    return [rates.map((r) => DEGREES * norm(r)), [...derivative, derivative.at(-1)]];
  }

  /** The three attitudes at a time. */
  at(x) {
    const i = this.segment(x);
    return [
      this.spline.evaluate(x),
      product(this.points[i], turn(scaled(this.steps[i], x - this.t[i]))),
      fromAngles(this.euler.evaluate(x)),
    ];
  }

  // ---- pictures ----

  layout({ width, height }) {
    if (width > 720) {
      const w = width * 0.54;
      return {
        main: [w * 0.5, height * 0.25, Math.min(w * 0.22, height * 0.2)],
        small: [[w * 0.25, height * 0.67, w * 0.1], [w * 0.75, height * 0.67, w * 0.1]],
        strip: [w, height - 32], chart: { x: w + 18, y: 12, width: width - w - 22, height: height - 18 },
      };
    }
    return {
      main: [width / 2, 110, Math.min(width * 0.24, 84)], small: [[width * 0.25, 265, width * 0.105], [width * 0.75, 265, width * 0.105]],
      strip: [width, 358], chart: { x: 0, y: 388, width, height: height - 392 },
    };
  }

  draw(context, stage) {
    const { colors } = stage;
    const { main, small, strip, chart } = this.layout(stage);
    this.main = main;
    const names = ["C² spline", "Slerp", "Euler angles"];
    const tints = [colors.spline, colors.other, colors.third];
    const rotations = this.error ? [this.points[this.selected]] : this.at(clamp(this.cursor, this.t[0], this.t.at(-1)));
    rotations.forEach((rotation, i) => {
      const [x, y, size] = i ? small[i - 1] : main;
      drawAeroplane(context, rotation, [x, y], size, tints[i], colors.paper);
      stage.text(names[i], x, y + size * 1.2 + 10, { align: "center", color: colors.ink, size: i ? 12 : 14, weight: 600 });
    });
    // Attitudes at the knots, which can be selected.
    const [width, y] = strip;
    this.strip = this.points.map((_, i) => [((i + 0.5) * width) / this.points.length, y]);
    this.points.forEach((rotation, i) => {
      const chosen = i === this.selected;
      if (chosen) {
        context.fillStyle = colors.sea;
        context.strokeStyle = colors.accent;
        context.lineWidth = 2;
        context.beginPath();
        context.roundRect(this.strip[i][0] - 36, y - 28, 72, 56, 8);
        context.fill();
        context.stroke();
      }
      drawAeroplane(context, rotation, this.strip[i], 19, colors.ink, chosen ? colors.sea : colors.paper);
    });
    if (!this.error) this.chart.draw(context, stage, chart, this.panels(colors));
  }

  panels(colors) {
    const { x, motion, slerp, eulerMotion } = this;
    const euler = (y) => ({ x, y, color: colors.third, dash: [3, 4], ignore: true });
    return [
      {
        title: "Angular speed in °/s",
        lines: [euler(eulerMotion[0]), { x, y: slerp.speed, color: colors.other, dash: [7, 5] }, { x, y: motion[0], color: colors.spline, width: 2.5 }],
      },
      {
        title: "Angular acceleration in °/s²",
        lines: [euler(eulerMotion[1]), { x: [], y: [], color: colors.other, jumps: slerp.jumps }, { x, y: motion[1], color: colors.spline, width: 2.5 }],
      },
    ];
  }

  remark() {
    const most = ([, values]) => Math.round(Math.max(...values));
    return `Largest angular acceleration: spline ${most([0, this.motion[1]])} °/s², Euler angles ${most([0, this.eulerMotion[1]])} °/s², Slerp infinite.`;
  }

  // ---- hands ----

  hit(x, y) {
    const [cx, cy, size] = this.main ?? [0, 0, 0];
    const found = (this.strip ?? []).findIndex(([px, py]) => Math.abs(px - x) < 38 && Math.abs(py - y) < 30);
    const [px, py, reach] = found >= 0 ? [...this.strip[found], 34] : [cx, cy, size * 1.3];
    if (Math.hypot(x - px, y - py) < reach || found >= 0) {
      return { cursor: "grab", move: this.trackball(found, px, py, reach, x, y) };
    }
    return this.chart.hit(x, y);
  }

  /** A trackball: what is under the pointer follows it. The rotation starts from the attitude at the first movement. */
  trackball(found, cx, cy, radius, x, y) {
    const direction = (px, py) => {
      const [u, v] = [(px - cx) / radius, (cy - py) / radius];
      const size = Math.hypot(u, v);
      const bent = size > 1 ? [u / size, v / size, 0] : [u, v, Math.sqrt(1 - size * size)];
      return bent;
    };
    const start = direction(x, y);
    let original;
    return (toX, toY) => {
      if (found >= 0) this.selected = found;
      this.toKnot();
      original ??= this.points[this.selected];
      // The turn of the screen, in the axes of the world.
      const onScreen = between(start, direction(toX, toY));
      this.set(this.selected, product(product(product(transposed(CAMERA), onScreen), CAMERA), original));
    };
  }

  set(index, rotation) {
    this.vectors[index] = write(rotation);
    this.changed();
  }

  /** Moves the cursor to the selected knot, so that the large aeroplane shows it. */
  toKnot() {
    this.moveCursor(this.t[this.selected]);
  }

  arrow(key, times) {
    if (!ARROWS[key]) return false;
    const [right, up] = ARROWS[key].map((x) => (x * times) / 30);
    this.toKnot();
    this.set(this.selected, product(product(product(transposed(CAMERA), turn([-up, right, 0])), CAMERA), this.points[this.selected]));
    return true;
  }

  // ---- Python ----

  program() {
    return [
      "import numpy as np", "import symspline as ss", "", "# Seconds, and rotation vectors in radians.", assign("t", [...this.t]),
      assign("vectors", this.vectors), "points = ss.rotations.from_rotation_vectors(vectors)",
      `spline = ss.CubicSpline(t, points, "so:3", bc_type="${this.ends}")`, "", "x = np.linspace(t[0], t[-1], 240)",
      "rotations = spline(x)", "rates = np.rad2deg(ss.rotations.angular_velocity(spline, x))  # body frame, °/s", "",
    ].join("\n");
  }
}

/** The vector of a rotation with four digits after the point. */
const write = (rotation) => turnVector(rotation).map((x) => rounded(x, 4));

/** The angular velocity in the body frame of a derivative of a rotation matrix. */
function rate(r, d) {
  const m = product(transposed(r), d);
  return [(m[7] - m[5]) / 2, (m[2] - m[6]) / 2, (m[3] - m[1]) / 2];
}
