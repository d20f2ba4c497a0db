// The land of the Earth on a globe. The method is that of the package's own maps.

import outlines from "./land.json";
import { clamp, fromLonlat } from "./vectors.js";

const LAND = outlines.map((differences) => {
  const points = [];
  const edge = [];
  let [lon, lat] = [0, 0];
  for (let i = 0; i < differences.length; i += 2) {
    lon += differences[i];
    lat += differences[i + 1];
    points.push(fromLonlat([lon / 10, lat / 10]));
    edge.push(Math.abs(lon) === 1800 || lat === -900);
  }
  return { points, edge };
});

/** Every third corner, for a globe that turns under the hand. */
const COARSE = LAND.filter(({ points }) => points.length > 12).map(({ points, edge }) => {
  const kept = points.map((_, i) => i).filter((i) => i % 3 === 0 || edge[i]);
  return { points: kept.map((i) => points[i]), edge: kept.map((i) => edge[i]) };
});

/** Longest chord along the horizon in radians. */
const CHORD = 0.1;

/** Draws sea, land and a grid of meridians and parallels; `coarse` is for a globe that turns. */
export function drawEarth(context, ball, colors, coarse = false) {
  const rings = coarse ? COARSE : LAND;
  const { x, y, radius } = ball;
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = colors.sea;
  context.fill();
  context.save();
  context.clip();
  context.beginPath();
  let around = 0;
  for (const { points } of rings) around += addRing(context, ball, points);
  // The land that contains the point opposite to the viewer goes around the horizon, which this circle compensates.
  if (around) {
    context.moveTo(x + radius, y);
    context.arc(x, y, radius, 0, 2 * Math.PI);
  }
  context.fillStyle = colors.land;
  context.fill("evenodd");
  context.beginPath();
  for (const ring of rings) addCoast(context, ball, ring);
  context.strokeStyle = colors.coast;
  context.lineWidth = 0.7;
  context.stroke();
  context.restore();
  graticule(context, ball, colors.grid);
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.strokeStyle = colors.coast;
  context.lineWidth = 1;
  context.stroke();
}

/**
 * Adds a ring with its far part moved to the horizon; returns whether it contains the point opposite to the viewer.
 * Rings run counterclockwise, and so clockwise if they are seen through the Earth.
 */
function addRing(context, ball, ring) {
  const seen = ring.map((point) => ball.project(point));
  if (!seen.some((place) => place[2] > 0)) return 0;
  let turned = 0;
  let before = null;
  for (const [px, py, depth] of [...seen, seen[0]]) {
    const [dx, dy] = [px - ball.x, py - ball.y];
    const angle = Math.atan2(dy, dx);
    if (before) {
      let step = angle - before.angle;
      step -= 2 * Math.PI * Math.round(step / (2 * Math.PI));
      turned += step;
      const parts = depth <= 0 && before.depth <= 0 ? Math.ceil(Math.abs(step) / CHORD) : 1;
      for (let i = 1; i < parts; i += 1) {
        const at = before.angle + (step * i) / parts;
        context.lineTo(ball.x + ball.radius * Math.cos(at), ball.y + ball.radius * Math.sin(at));
      }
    }
    put(context, ball, dx, dy, depth, before ? "lineTo" : "moveTo");
    before = { angle, depth };
  }
  context.closePath();
  // The axis of the screen points down, so that clockwise is positive.
  return Math.round(turned / (2 * Math.PI)) === 1 ? 1 : 0;
}

/** Adds the coast that is seen, without the lines along the date line and around the south pole. */
function addCoast(context, ball, { points, edge }) {
  let open = false;
  points.forEach((point, i) => {
    const [x, y, depth] = ball.project(point);
    const artificial = edge[i] && edge[i - 1];
    if (depth > 0) context[open && !artificial ? "lineTo" : "moveTo"](x, y);
    open = depth > 0;
  });
}

function put(context, ball, dx, dy, depth, method) {
  const scale = depth > 0 ? 1 : ball.radius * 1.002 / Math.max(Math.hypot(dx, dy), 1e-9);
  context[method](ball.x + dx * scale, ball.y + dy * scale);
}

function graticule(context, ball, color) {
  context.beginPath();
  const stroke = (points) => {
    let open = false;
    for (const point of points) {
      const [x, y, depth] = ball.project(point);
      if (depth > 0) context[open ? "lineTo" : "moveTo"](x, y);
      open = depth > 0;
    }
  };
  const steps = Array.from({ length: 61 }, (_, i) => i * 6);
  for (let lat = -60; lat <= 60; lat += 30) stroke(steps.map((lon) => fromLonlat([lon, lat])));
  for (let lon = 0; lon < 360; lon += 30) stroke(steps.slice(0, 31).map((s) => fromLonlat([lon, clamp(s - 90, -89, 89)])));
  context.strokeStyle = color;
  context.lineWidth = 0.6;
  context.stroke();
}
