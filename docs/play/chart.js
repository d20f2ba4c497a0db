// Graphs over time below a figure, with knots that can be dragged and a cursor that can be moved.

import { dot, line, nearest } from "./stage.js";
import { clamp } from "./vectors.js";

/** Round numbers for the axis of a graph. */
function ticks(most, count = 3) {
  const raw = most / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
  return Array.from({ length: Math.floor(most / step + 1e-9) + 1 }, (_, i) => i * step);
}

const SPACE = { left: 46, right: 14, title: 20, axis: 30 };

/**
 * Several graphs, one above the other, over one time axis.
 *
 * Each panel has a `title` and `lines`, a list of { x, y, color, width, dash, jumps }; `jumps` are [x, height] of
 * accelerations that are infinite.
 */
export class Chart {
  constructor({ figure, editable = true }) {
    Object.assign(this, { figure, editable });
  }

  draw(context, stage, box, panels) {
    this.box = box;
    const { t, cursor } = this.figure;
    const [start, end] = [t[0], t[t.length - 1]];
    const inner = { x: box.x + SPACE.left, width: box.width - SPACE.left - SPACE.right };
    this.toX = (time) => inner.x + ((time - start) / (end - start)) * inner.width;
    this.toTime = (x) => start + ((x - inner.x) / inner.width) * (end - start);
    const each = (box.height - SPACE.axis) / panels.length;
    panels.forEach((panel, i) => this.panel(context, stage, panel, inner, box.y + i * each + SPACE.title, each - SPACE.title - 6));
    this.axis = box.y + box.height - SPACE.axis + 8;
    line(context, [[inner.x, this.axis], [inner.x + inner.width, this.axis]], stage.colors.muted, 1);
    const x = this.toX(cursor);
    line(context, [[x, box.y + SPACE.title - 4], [x, this.axis]], stage.colors.accent, 1.25);
    t.forEach((time, i) => {
      const selected = i === this.figure.selected;
      const fill = selected ? stage.colors.accent : stage.colors.paper;
      dot(context, [this.toX(time), this.axis], this.editable ? 6 : 4, fill, stage.colors.ink);
      const fits = t.length < 9 || i === 0 || i === t.length - 1 || selected;
      if (fits) stage.text(String(Math.round(time * 100) / 100), this.toX(time), this.axis + 16, { align: "center", size: 11 });
    });
  }

  panel(context, stage, { title, lines, signed }, inner, top, height) {
    const { colors } = stage;
    let most = 1e-9;
    for (const { y, ignore } of lines) if (!ignore) for (const value of y) if (Number.isFinite(value)) most = Math.max(most, Math.abs(value));
    most *= 1.08;
    const middle = signed ? top + height / 2 : top + height;
    const scale = (signed ? height / 2 : height) / most;
    stage.text(title, inner.x - SPACE.left + 2, top - 11, { color: colors.ink, size: 12, weight: 600 });
    for (const tick of ticks(most, signed ? 1.6 : 3)) {
      for (const value of signed && tick ? [tick, -tick] : [tick]) {
        const y = middle - value * scale;
        line(context, [[inner.x, y], [inner.x + inner.width, y]], colors.grid, 1);
        stage.text(format(value), inner.x - 6, y, { align: "right", size: 11 });
      }
    }
    context.save();
    context.beginPath();
    context.rect(inner.x - 2, top - 2, inner.width + 4, height + 4);
    context.clip();
    for (const { x, y, color, width = 2, dash, jumps = [] } of lines) {
      // Values far outside are not seen, but dashes would be drawn all the way there.
      const place = (time, value) => [this.toX(time), middle - clamp(value * scale, -2 * height, 2 * height)];
      line(context, Array.from(x, (time, i) => (Number.isFinite(y[i]) ? place(time, y[i]) : null)), color, width, dash);
      for (const [time, jump] of jumps) {
        // An impulse, which no scale can show: an arrow that is longer for a larger jump of the velocity.
        const [at, tall] = [this.toX(time), Math.min(1, jump) * (height - 10)];
        if (tall < 2) continue;
        line(context, [[at, middle], [at, middle - tall]], color, 2);
        line(context, [[at - 4, middle - tall + 6], [at, middle - tall], [at + 4, middle - tall + 6]], color, 2);
      }
    }
    context.restore();
  }

  /** What lies under the pointer: a knot or the cursor. */
  hit(x, y) {
    const { figure, box } = this;
    if (!box || x < box.x || x > box.x + box.width || y < box.y || y > box.y + box.height) return null;
    const knots = figure.t.map((time) => [this.toX(time), this.axis]);
    const knot = Math.abs(y - this.axis) < 16 ? nearest(knots, x, this.axis, 14) : -1;
    if (knot >= 0 && this.editable) {
      figure.select(knot);
      // The axis keeps its scale while an end is dragged.
      const toTime = this.toTime;
      return { cursor: "ew-resize", move: (at) => figure.moveKnot(knot, toTime(at)), end: () => figure.endKnot?.() };
    }
    return { cursor: "col-resize", move: (at) => figure.moveCursor(this.toTime(at)) };
  }
}

/** A number of few characters. */
export function format(x) {
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e4 || size < 1e-3) return x.toExponential(0).replace("e+", "e");
  return String(Math.round(x * 1000) / 1000).replace("-", "−");
}
