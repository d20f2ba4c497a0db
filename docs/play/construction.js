// Figure 4: de Casteljau's algorithm with geodesics, in the plane, on the sphere and in the hyperbolic plane.

import { CubicSpline, Space } from "symspline";
import { Ball } from "./ball.js";
import { Chart } from "./chart.js";
import { assign } from "./code.js";
import { ARROWS, Figure, SAMPLES } from "./figure.js";
import { dot as mark, line, nearest } from "./stage.js";
import { clamp, fromLonlat, linspace, rounded, toLonlat } from "./vectors.js";

const T = [0, 1, 2, 3];
/** Most of a point's distance from the centre of the disk. */
const RIM = 0.97;

/** How the points of a space are drawn, moved and written in Python. */
const SPACES = {
  plane: {
    name: "r:2", start: [[-1.1, -0.5], [-0.4, 0.7], [0.5, -0.6], [1.1, 0.5]], point: (c) => [...c],
    show: (p, view) => [view.x + view.size * p[0], view.y - view.size * p[1]],
    find: (x, y, view) => [rounded((x - view.x) / view.size, 3), rounded((view.y - y) / view.size, 3)],
    step: ([a, b], [right, up]) => [rounded(a + 0.03 * right, 3), rounded(b + 0.03 * up, 3)],
    code: (c) => [assign("points", c)],
  },
  sphere: {
    name: "sphere:2", start: [[-55, -20], [-15, 35], [20, -30], [60, 25]], point: fromLonlat,
    show: (p, { ball }) => ball.project(p), find: (x, y, { ball }) => toLonlat(ball.unproject(x, y)),
    step: ([lon, lat], [right, up]) => [rounded(lon + 2 * right, 2), clamp(rounded(lat + 2 * up, 2), -90, 90)],
    code: (c) => [assign("lon", c.map((p) => p[0])), assign("lat", c.map((p) => p[1])), "points = ss.geo.from_lonlat(lon, lat)"],
  },
  disk: {
    name: "h:2", start: [[-0.62, -0.35], [-0.28, 0.42], [0.3, -0.38], [0.68, 0.3]],
    // From the disk of Poincaré to the hyperboloid, by stereographic projection.
    point: ([u, v]) => {
      const r = u * u + v * v;
      return [(1 + r) / (1 - r), (2 * u) / (1 - r), (2 * v) / (1 - r)];
    },
    show: ([w, u, v], view) => [view.x + (view.radius * u) / (1 + w), view.y - (view.radius * v) / (1 + w)],
    find: (x, y, view) => inside([(x - view.x) / view.radius, (view.y - y) / view.radius]),
    step: ([u, v], [right, up]) => inside([u + 0.02 * right, v + 0.02 * up]),
    code: (c) => [
      "# From Poincaré's disk to the hyperboloid.", assign("disk", c), "disk = np.array(disk)",
      "r = (disk**2).sum(axis=1, keepdims=True)", "points = np.hstack([1 + r, 2 * disk]) / (1 - r)",
    ],
  },
};

function inside([u, v]) {
  const size = Math.hypot(u, v);
  const scale = size > RIM ? RIM / size : 1;
  return [rounded(u * scale, 4), rounded(v * scale, 4)];
}

export class Construction extends Figure {
  constructor(root) {
    super(root, { seconds: 12 });
    this.on("ends", (value) => {
      this.ends = value;
    });
    for (const name of Object.keys(SPACES)) this.control(name)?.addEventListener("click", () => this.show(name));
  }

  show(name) {
    this.kind = name;
    this.setUp();
    for (const other of Object.keys(SPACES)) this.control(other)?.setAttribute("aria-pressed", String(other === name));
    this.changed();
  }

  setUp() {
    this.kind ??= "disk";
    this.spaces ??= Object.fromEntries(Object.entries(SPACES).map(([kind, { name }]) => [kind, new Space(name)]));
    this.ball ??= new Ball(0, 0);
    this.ball.look(2, 8);
    this.chart ??= new Chart({ figure: this });
    this.t = [...T];
    this.coordinates = SPACES[this.kind].start.map((c) => [...c]);
    this.selected = 1;
    this.ends = "natural";
    if (this.control("ends")) this.control("ends").value = this.ends;
  }

  get space() {
    return this.spaces[this.kind];
  }

  fit() {
    const { t, space } = this;
    this.points = this.coordinates.map(SPACES[this.kind].point);
    this.spline = new CubicSpline(t, this.points, space, { bcType: this.ends });
    this.x = linspace(t[0], t[t.length - 1], SAMPLES);
    this.line = this.spline.evaluate(this.x);
    this.controlPoints = this.spline.controlPoints;
    const velocity = this.spline.evaluate(this.x, 1);
    this.speed = this.line.map((p, i) => space.norm(p, velocity[i]));
  }

  /** The levels of de Casteljau's algorithm at the cursor, (8): four points, then three, two, and the point of the curve. */
  levels() {
    const { t, space } = this;
    const x = clamp(this.cursor, t[0], t.at(-1));
    const later = t.findIndex((time) => time > x);
    const i = later < 0 ? t.length - 2 : later - 1;
    const tau = (x - t[i]) / (t[i + 1] - t[i]);
    const levels = [this.controlPoints[i]];
    while (levels.at(-1).length > 1) {
      const points = levels.at(-1);
      levels.push(points.slice(1).map((q, k) => space.geodesic(points[k], q, tau)));
    }
    return { levels, segment: i };
  }

  // ---- pictures ----

  layout({ width, height }) {
    const wide = width > 720;
    const size = wide ? Math.min(height, width * 0.6) : Math.min(width, height * 0.62);
    const view = { x: (wide ? size : width) / 2, y: size / 2, radius: size / 2 - 10, size: size * 0.36, ball: this.ball };
    this.ball.place(view.x, view.y, view.radius);
    const chart = wide
      ? { x: size + 18, y: height * 0.28, width: width - size - 22, height: height * 0.5 }
      : { x: 0, y: size + 14, width, height: height - size - 18 };
    return { view, chart };
  }

  draw(context, stage) {
    const { colors } = stage;
    const { view, chart } = this.layout(stage);
    this.view = view;
    this.ground(context, view, colors);
    if (!this.error) {
      for (const [p, out, into, q] of this.controlPoints) {
        this.geodesic(context, p, out, colors.muted, 1, [3, 4]);
        this.geodesic(context, into, q, colors.muted, 1, [3, 4]);
      }
      this.stroke(context, this.line, colors.spline, 3.5);
      this.scaffold(context, stage);
    }
    this.places = this.points.map((p) => this.seen(p));
    this.places.forEach((at, i) => {
      const chosen = i === this.selected;
      if (at) mark(context, at, chosen ? 8 : 6.5, chosen ? colors.accent : colors.paper, colors.ink, 1.8);
    });
    if (!this.error) this.chart.draw(context, stage, chart, [{ title: "Speed", lines: [{ x: this.x, y: this.speed, color: colors.spline, width: 2.5 }] }]);
  }

  seen(p) {
    const [x, y, depth = 1] = SPACES[this.kind].show(p, this.view);
    return depth > -0.05 ? [x, y] : null;
  }

  ground(context, view, colors) {
    if (this.kind !== "plane") {
      mark(context, [view.x, view.y], view.radius, colors.sea, colors.coast, 1);
      if (this.kind === "disk") {
        // Circles at equal distances about the centre: those near the rim are as far apart as those in the middle.
        for (let d = 1; d < 4.5; d += 1) mark(context, [view.x, view.y], view.radius * Math.tanh(d / 2), null, colors.grid, 1);
      } else {
        for (let lat = -60; lat <= 60; lat += 30) this.stroke(context, Array.from({ length: 61 }, (_, i) => fromLonlat([6 * i, lat])), colors.grid, 0.8);
        for (let lon = 0; lon < 360; lon += 30) this.stroke(context, Array.from({ length: 31 }, (_, i) => fromLonlat([lon, 6 * i - 90])), colors.grid, 0.8);
      }
      return;
    }
    const { x, y, size, radius } = view;
    for (let i = -3; i <= 3; i += 1) {
      const at = (i * size) / 2.2;
      line(context, [[x + at, y - radius], [x + at, y + radius]], colors.grid, 0.8);
      line(context, [[x - radius, y + at], [x + radius, y + at]], colors.grid, 0.8);
    }
  }

  stroke(context, points, color, width, dash) {
    line(context, points.map((p) => {
      const [x, y, depth = 1] = SPACES[this.kind].show(p, this.view);
      return depth >= 0 ? [x, y] : null;
    }), color, width, dash);
  }

  geodesic(context, p, q, color, width, dash) {
    this.stroke(context, this.space.geodesic(p, q, linspace(0, 1, 24)), color, width, dash);
  }

  scaffold(context, stage) {
    const { colors } = stage;
    const { levels, segment } = this.levels();
    const tints = [colors.ink, colors.other, colors.third];
    levels.slice(0, 3).forEach((points, level) => {
      points.slice(1).forEach((q, i) => this.geodesic(context, points[i], q, tints[level], level ? 2 : 1.4));
    });
    levels.slice(0, 3).forEach((points, level) => {
      for (const p of points) {
        const at = this.seen(p);
        if (at) mark(context, at, level ? 4 : 4.5, level ? tints[level] : colors.paper, tints[level], 1.4);
      }
    });
    const names = [`p${segment}`, `q${segment}⁺`, `q${segment + 1}⁻`, `p${segment + 1}`];
    names.forEach((name, i) => {
      const at = this.seen(levels[0][i]);
      if (at) stage.text(name, at[0] + 11, at[1] - 12, { color: colors.ink, size: 13, weight: 600 });
    });
    const at = this.seen(levels[3][0]);
    if (at) mark(context, at, 6, colors.spline, colors.paper, 2);
  }

  remark() {
    const { residual } = this.spline.report;
    return `Relative C² residual: ${residual.toExponential(1)}.`;
  }

  // ---- hands ----

  hit(x, y) {
    const found = nearest(this.places ?? [], x, y, 20);
    if (found >= 0) {
      this.select(found);
      return { cursor: "move", move: (px, py) => this.set(found, SPACES[this.kind].find(px, py, this.view)) };
    }
    if (this.kind === "sphere" && this.ball.contains(x, y)) return this.ball.grab(x, y);
    return this.chart.hit(x, y);
  }

  set(index, coordinates) {
    this.coordinates[index] = coordinates;
    this.changed();
  }

  arrow(key, times) {
    if (!ARROWS[key]) return false;
    const step = ARROWS[key].map((s) => s * times);
    this.set(this.selected, SPACES[this.kind].step(this.coordinates[this.selected], step));
    return true;
  }

  program() {
    const { name, code } = SPACES[this.kind];
    return [
      "import numpy as np", "import symspline as ss", "", assign("t", [...this.t]), ...code(this.coordinates),
      `spline = ss.CubicSpline(t, points, "${name}", bc_type="${this.ends}")`, "", "x = np.linspace(t[0], t[-1], 400)",
      "curve = spline(x)", "p, q_out, q_in, p_next = spline.control_points[0]", "",
    ].join("\n");
  }
}
