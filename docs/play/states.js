// Figure 3: states of a qubit on the Bloch sphere, or covariance ellipses.

import { Bloch } from "./bloch.js";
import { Ellipses } from "./ellipses.js";
import { Figure } from "./figure.js";

const KINDS = { bloch: Bloch, ellipses: Ellipses };

/** The figure of one of two kinds of data; a kind has the points, the curves and the pictures. */
export class States extends Figure {
  constructor(root) {
    super(root);
    this.on("ends", (value) => {
      this.kind.ends = value;
    });
    for (const name of Object.keys(KINDS)) this.control(name)?.addEventListener("click", () => this.show(name));
    this.show("bloch");
  }

  setUp() {
    this.kinds ??= Object.fromEntries(Object.entries(KINDS).map(([name, Kind]) => [name, new Kind(this)]));
    this.kind ??= this.kinds.bloch;
    this.kind.setUp();
    this.selected = 1;
    const control = this.control("ends");
    if (control) control.value = this.kind.ends;
  }

  show(name) {
    this.kind = this.kinds[name];
    this.setUp();
    for (const other of Object.keys(KINDS)) this.control(other)?.setAttribute("aria-pressed", String(other === name));
    this.control("question").textContent = this.kind.question;
    this.control("text").textContent = this.kind.text;
    this.follow();
    this.changed();
  }

  get t() {
    return this.kind.t;
  }

  get x() {
    return this.kind.x;
  }

  get spline() {
    return this.kind.spline;
  }

  fit() {
    this.kind.fit();
  }

  draw(context, stage) {
    this.kind.draw(context, stage);
  }

  hit(x, y) {
    return this.kind.hit(x, y);
  }

  arrow(key, times) {
    return this.kind.arrow(key, times);
  }

  remark() {
    return this.kind.remark();
  }

  program() {
    return this.kind.program();
  }
}
