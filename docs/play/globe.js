// Figure 1: points on the globe, which can be dragged, and curves through them.

import { CubicSpline, makeSmoothingSpline, Space } from "symspline";
import { Ball } from "./ball.js";
import { Chart, format } from "./chart.js";
import { assign, literal } from "./code.js";
import { ARROWS, Figure, SAMPLES } from "./figure.js";
import { drawEarth } from "./land.js";
import { dot as mark, line, nearest } from "./stage.js";
import { clamp, cross, dot, fromLonlat, linspace, norm, plus, rounded, scaled, toLonlat, unit } from "./vectors.js";

/** Kilometres of a radian on the Earth. */
const EARTH = 6371;
const DEGREE = Math.PI / 180;
/** From Tokyo over the date line to Anchorage, over the pole to Svalbard, and on to Madeira. */
const START = {
  t: [0, 8, 17, 24, 33],
  lonlat: [[139.7, 35.7], [-160, 56], [-110, 80], [22, 74], [-17, 33]],
};
const NOISY = 48;
/** Standard normal numbers, the same in every session. */
const NOISE = normal(2 * NOISY);

function normal(count) {
  let state = 20;
  const uniform = () => {
    // Mulberry32.
    state = (state + 0x6d2b79f5) | 0;
    let z = Math.imul(state ^ (state >>> 15), 1 | state);
    z = (z + Math.imul(z ^ (z >>> 7), 61 | z)) ^ z;
    return ((z ^ (z >>> 14)) >>> 0) / 2 ** 32;
  };
  return Array.from({ length: count }, () => Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform()));
}

export class Globe extends Figure {
  constructor(root, options = {}) {
    super(root, { add: (x, y) => this.add(x, y) });
    this.on("ends", (value) => {
      this.ends = value;
    });
    this.on("geodesics", (value) => {
      this.show.geodesics = value;
    });
    this.on("lonlat", (value) => {
      this.show.lonlat = value;
    });
    this.on("noise", (value) => {
      this.noise = Number(value);
    });
    this.on("lam", (value) => {
      this.lam = Number(value);
    });
    this.on("auto", (value) => {
      this.automatic = value;
    });
    this.control("add")?.addEventListener("click", () => this.addInLongest());
    this.control("remove")?.addEventListener("click", () => this.remove());
    this.bare = Boolean(options.bare);
  }

  setUp() {
    this.space ??= new Space("sphere:2");
    this.t = [...START.t];
    this.lonlat = START.lonlat.map((place) => [...place]);
    this.ball ??= new Ball(0, 0);
    this.ball.look(-170, 62);
    this.chart ??= new Chart({ figure: this });
    this.selected = 1;
    this.ends = "not-a-knot";
    this.show = { geodesics: this.control("geodesics") !== null, lonlat: this.control("lonlat") !== null };
    this.noise = 0;
    this.lam = -1;
    this.automatic = true;
    const values = { ends: this.ends, noise: 0, lam: -1 };
    for (const [name, value] of Object.entries(values)) if (this.control(name)) this.control(name).value = value;
    for (const name of ["geodesics", "lonlat", "auto"]) if (this.control(name)) this.control(name).checked = true;
  }

  // ---- curves ----

  get curve() {
    return this.smooth ?? this.spline;
  }

  fit() {
    const { t, ends, space } = this;
    this.points = this.lonlat.map(fromLonlat);
    this.spline = new CubicSpline(t, this.points, space, { bcType: ends });
    this.x = linspace(t[0], t[t.length - 1], SAMPLES);
    this.noisy = this.noise > 0 ? this.measured() : null;
    this.smooth = this.noisy && this.smoothed();
    for (const name of ["geodesics", "lonlat"]) if (this.control(name)) this.control(name).disabled = Boolean(this.noisy);
    const shown = this.curve;
    this.line = shown.evaluate(this.x);
    this.motion = [1, 2].map((nu) => shown.evaluate(this.x, nu).map((v) => EARTH * norm(v)));
    this.band = this.smooth && [...this.smooth.band(this.x)];
    this.geodesics = this.show.geodesics && !this.noisy ? this.polygon() : null;
    this.naive = this.show.lonlat && !this.noisy ? this.charted() : null;
  }

  /** Noisy measurements of positions along the curve. */
  measured() {
    const times = linspace(this.t[0], this.t[this.t.length - 1], NOISY).map((x) => rounded(x, 2));
    const lonlat = this.spline.evaluate(times).map((p, i) => {
      const east = unit(cross(Math.abs(p[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], p));
      const north = cross(p, east);
      const off = scaled(plus(scaled(east, NOISE[2 * i]), scaled(north, NOISE[2 * i + 1])), this.noise * DEGREE);
      return toLonlat(unit(plus([...p], off)));
    });
    return { t: [...times], lonlat, points: lonlat.map(fromLonlat) };
  }

  smoothed() {
    const lam = this.automatic ? undefined : 10 ** this.lam;
    const smooth = makeSmoothingSpline(this.noisy.t, this.noisy.points, this.space, { lam });
    const slider = this.control("lam");
    if (this.automatic) this.lam = clamp(rounded(Math.log10(smooth.lam), 3), -6, 6);
    if (slider) Object.assign(slider, { value: this.lam, disabled: this.automatic });
    return smooth;
  }

  /** Geodesics between neighbours, with the jumps of their velocity. */
  polygon() {
    const { t, points, space } = this;
    const steps = points.slice(1).map((q, i) => space.log(points[i], q));
    const places = [];
    const speed = [];
    steps.forEach((step, i) => {
      const last = i === steps.length - 1;
      const own = this.x.filter((x) => x >= t[i] && (last || x < t[i + 1]));
      places.push(...space.geodesic(points[i], points[i + 1], own.map((x) => (x - t[i]) / (t[i + 1] - t[i]))));
      speed.push(...new Array(own.length).fill((EARTH * norm(step)) / (t[i + 1] - t[i])));
    });
    const jumps = t.slice(1, -1).map((time, k) => {
      const before = scaled(space.log(points[k + 1], points[k]), -1 / (time - t[k]));
      const after = scaled(steps[k + 1], 1 / (t[k + 2] - time));
      return [time, norm(plus(after, scaled(before, -1)))];
    });
    const most = Math.max(...speed) / EARTH;
    return { places, speed, jumps: jumps.map(([time, jump]) => [time, jump / most]) };
  }

  /** The cubic spline of longitude and latitude, as if the map were flat. */
  charted() {
    const flat = new CubicSpline(this.t, this.lonlat, "r:2", { bcType: this.ends });
    const [at, first, second] = [0, 1, 2].map((nu) => flat.evaluate(this.x, nu));
    const speed = [];
    const acceleration = [];
    at.forEach(([, lat], i) => {
      const [c, s] = [Math.cos(lat * DEGREE), Math.sin(lat * DEGREE)];
      const [dl, dp] = scaled([...first[i], 0], DEGREE);
      const [ddl, ddp] = scaled([...second[i], 0], DEGREE);
      speed.push(EARTH * Math.hypot(c * dl, dp));
      // The covariant derivative in these coordinates, by the Christoffel symbols of the sphere.
      acceleration.push(EARTH * Math.hypot(c * ddl - 2 * s * dl * dp, ddp + s * c * dl * dl));
    });
    return { places: at.map(fromLonlat), speed, acceleration };
  }

  // ---- pictures ----

  layout({ width, height }) {
    if (this.bare) return { ball: [width / 2, height / 2, Math.min(width, height) / 2 - 8] };
    if (width > 720) {
      const size = Math.min(height, width * 0.56);
      return { ball: [size / 2, height / 2, size / 2 - 10], chart: { x: size + 18, y: 12, width: width - size - 22, height: height - 18 } };
    }
    const radius = Math.min(width / 2 - 8, height * 0.31);
    return { ball: [width / 2, radius + 10, radius], chart: { x: 0, y: 2 * radius + 26, width, height: height - 2 * radius - 30 } };
  }

  draw(context, stage) {
    const { colors } = stage;
    const { ball: place, chart } = this.layout(stage);
    this.ball.place(...place);
    this.earth(context, stage);
    if (this.error) this.chord(context, colors);
    else this.curves(context, colors);
    this.places = this.points.map((p) => {
      const [x, y, depth] = this.ball.project(p);
      return depth > -0.02 ? [x, y] : null;
    });
    this.places.forEach((at, i) => {
      if (!at) return;
      const selected = i === this.selected;
      mark(context, at, selected ? 8 : 6.5, selected ? colors.accent : colors.paper, colors.ink, 1.8);
      stage.text(String.fromCharCode(65 + (i % 26)), at[0] + 11, at[1] - 11, { color: colors.ink, size: 13, weight: 600 });
    });
    if (chart && !this.error) this.chart.draw(context, stage, chart, this.panels(colors));
  }

  /** Sea and land change only with the view, and are kept as a picture. */
  earth(context, stage) {
    const { ball, canvas } = this;
    const turning = Boolean(stage.held?.turning);
    const name = [ball.version, stage.version, canvas.width, canvas.height, turning].join();
    if (name !== this.kept) {
      this.kept = name;
      this.picture ??= document.createElement("canvas");
      Object.assign(this.picture, { width: canvas.width, height: canvas.height });
      const own = this.picture.getContext("2d");
      own.setTransform(stage.ratio, 0, 0, stage.ratio, 0, 0);
      drawEarth(own, ball, stage.colors, turning);
    }
    context.drawImage(this.picture, 0, 0, stage.width, stage.height);
  }

  curves(context, colors) {
    const draw = (points, color, width, dash) => {
      const { near, far } = this.ball.split(points);
      context.globalAlpha = 0.22;
      line(context, far, color, width, dash);
      context.globalAlpha = 1;
      line(context, near, color, width, dash);
    };
    if (this.naive) draw(this.naive.places, colors.third, 2, [3, 4]);
    if (this.geodesics) draw(this.geodesics.places, colors.other, 2, [7, 5]);
    if (this.smooth) {
      this.drawBand(context, colors);
      for (const p of this.noisy.points) {
        const [x, y, depth] = this.ball.project(p);
        if (depth > 0) mark(context, [x, y], 2.2, colors.muted);
      }
    }
    draw(this.line, colors.spline, 3.5);
    const [x, y, depth] = this.ball.project(this.curve.evaluate(clamp(this.cursor, ...this.curve.domain)));
    if (depth > 0) mark(context, [x, y], 5, colors.spline, colors.paper, 2);
  }

  /** The union of the credible balls, drawn as a ribbon. */
  drawBand(context, colors) {
    const tangents = this.smooth.evaluate(this.x, 1);
    const sides = [1, -1].map((sign) =>
      this.line.map((p, i) => {
        const side = unit(cross(p, tangents[i]));
        const angle = sign * this.band[i];
        return plus(scaled(p, Math.cos(angle)), scaled(side, Math.sin(angle)));
      }));
    context.fillStyle = colors.band;
    context.beginPath();
    for (let i = 1; i < this.line.length; i += 1) {
      const corners = [sides[0][i - 1], sides[0][i], sides[1][i], sides[1][i - 1]].map((p) => this.ball.project(p));
      if (corners.some((corner) => !(corner[2] > 0))) continue;
      corners.forEach(([cx, cy], k) => context[k ? "lineTo" : "moveTo"](cx, cy));
      context.closePath();
    }
    context.fill("nonzero");
  }

  /** What remains to be seen when there is no curve. */
  chord(context, colors) {
    const i = this.error.index;
    if (i === null || !this.points[i + 1]) return;
    line(context, [this.points[i], this.points[i + 1]].map((p) => this.ball.project(p)), colors.other, 2, [3, 4]);
  }

  panels(colors) {
    const { x, motion, geodesics, naive } = this;
    const speed = [{ x, y: motion[0], color: colors.spline, width: 2.5 }];
    const acceleration = [{ x, y: motion[1], color: colors.spline, width: 2.5 }];
    if (geodesics) {
      speed.unshift({ x, y: geodesics.speed, color: colors.other, dash: [7, 5] });
      acceleration.unshift({ x: [], y: [], color: colors.other, jumps: geodesics.jumps });
    }
    if (naive) {
      speed.unshift({ x, y: naive.speed, color: colors.third, dash: [3, 4], ignore: true });
      acceleration.unshift({ x, y: naive.acceleration, color: colors.third, dash: [3, 4], ignore: true });
    }
    return [
      { title: "Speed in km/h", lines: speed },
      { title: "Acceleration in km/h²", lines: acceleration },
    ];
  }

  remark() {
    if (this.smooth) {
      const { df, sigma } = this.smooth;
      const level = format(rounded((sigma / DEGREE), 2));
      return `λ = ${this.smooth.lam.toPrecision(3)}, ${df.toFixed(1)} degrees of freedom per coordinate, estimated noise ${level}°. The band contains the true position with a probability of 95 %, on average over time.`;
    }
    return "";
  }

  // ---- hands ----

  hit(x, y) {
    const found = nearest(this.places ?? [], x, y, 20);
    if (found >= 0) {
      this.select(found);
      return { cursor: "move", move: (px, py) => this.movePoint(found, this.ball.unproject(px, py)) };
    }
    if (this.ball.contains(x, y)) return { ...this.ball.grab(x, y), scrolls: this.bare };
    return this.bare ? null : this.chart.hit(x, y);
  }

  movePoint(index, point) {
    const place = toLonlat(point);
    if (place.every((value, i) => value === this.lonlat[index][i])) return;
    this.lonlat[index] = place;
    this.changed();
  }

  /** Adds a point on the curve where it was hit, and otherwise at the end. */
  add(x, y) {
    if (!this.ball.contains(x, y) || nearest(this.places, x, y, 14) >= 0 || this.t.length > 25) return;
    const seen = this.line.map((p) => this.ball.project(p)).map((at) => (at[2] > 0 ? at : null));
    const on = nearest(seen, x, y, 12);
    const time = rounded(this.x[on], 2);
    if (on >= 0 && !this.t.includes(time)) this.insert(time, toLonlat(this.ball.unproject(x, y)));
    else this.insert(rounded(this.t.at(-1) + (this.t.at(-1) - this.t[0]) / (this.t.length - 1), 2), toLonlat(this.ball.unproject(x, y)));
  }

  insert(time, place) {
    const index = this.t.findIndex((knot) => knot > time);
    const at = index < 0 ? this.t.length : index;
    this.t.splice(at, 0, time);
    this.lonlat.splice(at, 0, place);
    this.selected = at;
    this.changed();
  }

  addInLongest() {
    if (this.error || this.t.length > 25) return;
    const gaps = this.t.slice(1).map((time, i) => time - this.t[i]);
    const i = gaps.indexOf(Math.max(...gaps));
    const time = rounded(this.t[i] + gaps[i] / 2, 2);
    this.insert(time, toLonlat(this.spline.evaluate(time)));
  }

  remove() {
    if (this.t.length < 3) return;
    this.t.splice(this.selected, 1);
    this.lonlat.splice(this.selected, 1);
    this.selected = Math.min(this.selected, this.t.length - 1);
    this.changed();
  }

  arrow(key, times) {
    if (key === "Delete" || key === "Backspace") this.remove();
    else if (key === "a" || key === "+") this.addInLongest();
    else if (ARROWS[key]) {
      // One degree on the screen, whatever the view.
      const [right, up] = ARROWS[key].map((x) => x * times * DEGREE);
      const { view } = this.ball;
      const step = plus(scaled(view.slice(0, 3), right), scaled(view.slice(3, 6), up));
      const p = this.points[this.selected];
      this.movePoint(this.selected, unit(plus(p, plus(step, scaled(p, -dot(step, p))))));
    } else return false;
    return true;
  }

  // ---- Python ----

  program() {
    const { t, lonlat } = this.noisy ?? this;
    const data = [assign("t", [...t]), assign("lon", lonlat.map((p) => p[0])), assign("lat", lonlat.map((p) => p[1]))];
    const fit = this.noisy
      ? `spline = ss.make_smoothing_spline(t, points, "sphere:2"${this.automatic ? "" : `, lam=${literal(10 ** this.lam)}`})`
      : `spline = ss.CubicSpline(t, points, "sphere:2", bc_type="${this.ends}")`;
    return [
      "import numpy as np", "import symspline as ss", "", "# Hours, and degrees.", ...data,
      "points = ss.geo.from_lonlat(lon, lat)", fit, "",
      "x = np.linspace(t[0], t[-1], 400)", "lon, lat = ss.geo.to_lonlat(spline(x))", "speed = 6371 * spline.speed(x)  # km/h",
      ...(this.noisy ? ["radius = spline.band(x)  # 95 % credible balls, in radians"] : []), "",
    ].join("\n");
  }
}

