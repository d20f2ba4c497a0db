// What all figures share: knots with times, a cursor that runs along the curve, controls, and the Python program.

import { SymsplineError } from "symspline";
import { CodePanel } from "./code.js";
import { Clock, Stage } from "./stage.js";
import { clamp, rounded } from "./vectors.js";

/** Samples of a curve in figures. */
export const SAMPLES = 400;
/** Least interval between knots, as a part of the whole. */
const CLOSEST = 0.02;

export class Figure {
  /** `root` is the element of the figure, with a canvas, controls named by `data-play`, and a place for messages. */
  constructor(root, { seconds = 9, add = null } = {}) {
    this.root = root;
    this.canvas = root.querySelector("canvas");
    this.note = root.querySelector(".play-note");
    this.selected = 0;
    this.cursor = 0;
    this.error = null;
    this.dirty = true;
    this.setUp();
    this.stage = new Stage(this.canvas, {
      draw: (context, stage) => {
        this.refresh();
        this.draw(context, stage);
      },
      hit: (x, y, stage) => this.hit(x, y, stage),
      key: (key, shift) => this.key(key, shift),
      add,
    });
    this.clock = new Clock(this.stage, seconds, () => this.follow());
    this.follow();
    const panel = root.querySelector("details.play-program");
    this.code = panel && new CodePanel(panel, () => this.program());
    const button = this.control("play");
    if (button) {
      button.addEventListener("click", () => this.play(!this.clock.playing));
      this.play(this.clock.playing);
    }
    this.control("reset")?.addEventListener("click", () => {
      this.setUp();
      this.changed();
    });
  }

  control(name) {
    return this.root.querySelector(`[data-play="${name}"]`);
  }

  /** Calls back with the new value of a control. */
  on(name, callback) {
    const control = this.control(name);
    if (!control) return;
    control.addEventListener(control.type === "range" ? "input" : "change", () => {
      callback(control.type === "checkbox" ? control.checked : control.value);
      this.changed();
    });
  }

  play(on) {
    this.clock.playing = on;
    const button = this.control("play");
    if (button) button.textContent = on ? "Pause" : "Play";
  }

  /** The curve that the Python program computes. */
  get curve() {
    return this.spline;
  }

  /** Fits the curves again before the next frame. */
  changed() {
    this.dirty = true;
    this.stage.request();
  }

  refresh() {
    if (!this.dirty) return;
    this.dirty = false;
    try {
      this.fit();
      this.error = null;
    } catch (error) {
      if (!(error instanceof SymsplineError)) throw error;
      this.error = error;
    }
    if (this.note) {
      const text = this.error ? this.error.message : this.remark?.() ?? "";
      if (this.note.textContent !== text) this.note.textContent = text;
      this.note.classList.toggle("play-error", Boolean(this.error));
    }
    this.code?.update();
  }

  follow() {
    const { t } = this;
    this.cursor = t[0] + this.clock.fraction * (t[t.length - 1] - t[0]);
  }

  select(index) {
    this.selected = index;
    this.stage.request();
  }

  moveCursor(time) {
    const { t } = this;
    this.play(false);
    this.clock.fraction = clamp((time - t[0]) / (t[t.length - 1] - t[0]), 0, 1);
    this.follow();
  }

  /** Moves a knot between its neighbours; the first and the last stay, so that the axis keeps its scale. */
  moveKnot(index, time) {
    const { t } = this;
    if (index === 0 || index === t.length - 1) return;
    const least = CLOSEST * (t[t.length - 1] - t[0]);
    t[index] = rounded(clamp(time, t[index - 1] + least, t[index + 1] - least), 2);
    this.changed();
  }

  /** Keys that all figures have: choosing a knot, moving its time, and playing. */
  key(key, shift) {
    const count = this.t.length;
    if (key === "n" || key === ".") this.selected = (this.selected + 1) % count;
    else if (key === "p" || key === ",") this.selected = (this.selected + count - 1) % count;
    else if (key === " ") this.play(!this.clock.playing);
    else if (key === "<" || key === "[") this.moveKnot(this.selected, this.t[this.selected] - 0.05);
    else if (key === ">" || key === "]") this.moveKnot(this.selected, this.t[this.selected] + 0.05);
    else return this.arrow?.(key, shift ? 4 : 1) ?? false;
    return true;
  }
}

/** The step of an arrow key, to the right and up. */
export const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
