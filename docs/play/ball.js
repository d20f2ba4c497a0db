// A sphere as seen from far away, which can be turned: the grabbed place stays under the cursor.

import { apply, between, clamp, fromLonlat, product, transposed } from "./vectors.js";

export class Ball {
  /** `view` has the rows east, north and up of the picture. */
  constructor(lon, lat) {
    this.look(lon, lat);
    [this.x, this.y, this.radius] = [0, 0, 1];
  }

  look(lon, lat) {
    this.view = [...fromLonlat([lon + 90, 0]), ...fromLonlat([lon, lat + 90]), ...fromLonlat([lon, lat])];
    this.version = (this.version ?? 0) + 1;
  }

  place(x, y, radius) {
    if (x === this.x && y === this.y && radius === this.radius) return;
    Object.assign(this, { x, y, radius });
    this.version += 1;
  }

  /** Place on the screen, and the depth, positive for what is seen. */
  project(point) {
    const [x, y, z] = apply(this.view, point);
    return [this.x + this.radius * x, this.y - this.radius * y, z];
  }

  /** The point under the cursor; beyond the rim, the nearest one on it. */
  unproject(x, y) {
    return apply(transposed(this.view), this.direction(x, y));
  }

  contains(x, y, margin = 0) {
    return Math.hypot(x - this.x, y - this.y) <= this.radius + margin;
  }

  direction(x, y) {
    let [u, v] = [(x - this.x) / this.radius, (this.y - y) / this.radius];
    const size = Math.hypot(u, v);
    if (size > 1) [u, v] = [u / size, v / size];
    return [u, v, Math.sqrt(clamp(1 - u * u - v * v, 0, 1))];
  }

  /** Turns the ball so that what is under the cursor stays there. */
  grab(x, y) {
    let from = this.direction(x, y);
    return {
      cursor: "grab",
      turning: true,
      move: (toX, toY) => {
        const to = this.direction(toX, toY);
        this.view = orthonormal(product(between(from, to), this.view));
        this.version += 1;
        from = to;
      },
    };
  }

  turn(axis) {
    this.view = orthonormal(product(axis, this.view));
    this.version += 1;
  }

  /** The parts of a line on the near and on the far side, with gaps where the other part is. */
  split(points) {
    const near = [];
    const far = [];
    for (const point of points) {
      const place = this.project(point);
      near.push(place[2] >= 0 ? place : null);
      far.push(place[2] < 0 ? place : null);
    }
    for (let i = 1; i < near.length; i += 1) {
      // The far part reaches up to the near one.
      if (near[i] && far[i - 1]) far[i] = near[i];
      else if (near[i - 1] && far[i] && !far[i - 1]) far[i - 1] = near[i - 1];
    }
    return { near, far };
  }
}

/** Removes rounding errors of many small turns (Gram–Schmidt). */
function orthonormal(m) {
  const rows = [m.slice(0, 3), m.slice(3, 6)];
  const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
  const unit = (a) => a.map((x) => x / Math.sqrt(dot(a, a)));
  const a = unit(rows[0]);
  const b = unit(rows[1].map((x, i) => x - dot(rows[1], a) * a[i]));
  return [...a, ...b, a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
