// A canvas that is as sharp as its screen, knows the page's colours, and moves what is dragged.

const NAMES = ["ink", "muted", "grid", "paper", "sea", "land", "coast", "spline", "other", "third", "band", "accent"];

/** Calls back when the page switches between light and dark. */
function onTheme(callback) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", callback);
  const observer = new MutationObserver(callback);
  for (const element of [document.documentElement, document.body]) {
    observer.observe(element, { attributes: true, attributeFilter: ["data-theme", "class"] });
  }
}

/**
 * The canvas of a figure.
 *
 * `draw(context, stage)` paints it; `hit(x, y, stage)` returns what lies under the pointer, an object with `cursor`,
 * `move(x, y)`, and if needed `end()`, or nothing. With `scrolls`, a finger that moves up or down scrolls the page instead.
 */
export class Stage {
  constructor(canvas, { draw, hit = () => null, key = () => false, add = null }) {
    Object.assign(this, { canvas, draw, hit, key, context: canvas.getContext("2d") });
    this.width = this.height = 0;
    this.colors = {};
    this.held = this.pending = null;
    this.frames = [];
    this.visible = true;
    new ResizeObserver(() => this.resize()).observe(canvas);
    new IntersectionObserver(([entry]) => {
      this.visible = entry.isIntersecting;
    }).observe(canvas);
    onTheme(() => this.recolor());
    this.listen(add);
    this.recolor();
    this.resize();
  }

  recolor() {
    const style = getComputedStyle(this.canvas);
    for (const name of NAMES) this.colors[name] = style.getPropertyValue(`--play-${name}`).trim() || "#888";
    this.font = style.fontFamily;
    this.version = (this.version ?? 0) + 1;
    this.request();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    if (!clientWidth) return;
    const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    Object.assign(this, { width: clientWidth, height: clientHeight, ratio });
    this.paint();
  }

  /** Paints at the next frame of the screen. */
  request() {
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = undefined;
      this.paint();
    });
  }

  paint() {
    if (!this.width) return;
    if (this.pending) {
      const [x, y] = this.pending;
      this.pending = null;
      this.held?.move(x, y);
    }
    const { context, ratio } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    context.lineJoin = context.lineCap = "round";
    this.draw(context, this);
  }

  /** Text in the page's font. */
  text(string, x, y, { color = this.colors.muted, size = 12, align = "left", weight = 400 } = {}) {
    Object.assign(this.context, { fillStyle: color, font: `${weight} ${size}px ${this.font}`, textAlign: align });
    this.context.textBaseline = "middle";
    this.context.fillText(string, x, y);
  }

  listen(add) {
    const { canvas } = this;
    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || this.held) return;
      const held = this.hit(...place(event), this);
      if (!held) return;
      this.held = held;
      canvas.setPointerCapture(event.pointerId);
      canvas.style.cursor = held.cursor === "grab" ? "grabbing" : held.cursor;
      this.request();
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.held) {
        // Several events may come per frame; the last one counts.
        this.pending = place(event);
        this.request();
      } else if (event.pointerType === "mouse") {
        canvas.style.cursor = this.hit(...place(event), this)?.cursor ?? "default";
      }
    });
    const release = () => {
      if (!this.held) return;
      const held = this.held;
      this.paint();
      this.held = null;
      held.end?.();
      canvas.style.cursor = "default";
      this.request();
    };
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(name, release);
    // A finger on something that can be dragged must not scroll the page.
    const onTouch = (event) => {
      const box = canvas.getBoundingClientRect();
      const touch = event.changedTouches[0];
      const found = this.hit(touch.clientX - box.left, touch.clientY - box.top, this);
      if (found && !found.scrolls) event.preventDefault();
    };
    canvas.addEventListener("touchstart", onTouch, { passive: false });
    if (add) canvas.addEventListener("dblclick", (event) => add(...place(event)));
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !this.key(event.key, event.shiftKey)) return;
      event.preventDefault();
      this.request();
    });
  }
}

/** The nearest of several places, if it is within reach of the pointer. */
export function nearest(places, x, y, reach = 16) {
  let found = -1;
  let best = reach;
  places.forEach((place, i) => {
    const distance = place ? Math.hypot(place[0] - x, place[1] - y) : Infinity;
    if (distance < best) [found, best] = [i, distance];
  });
  return found;
}

/** A time that runs from the first to the last knot and starts again; it stops while the page is not looked at. */
export class Clock {
  constructor(stage, seconds, tick) {
    Object.assign(this, { stage, seconds, tick, fraction: 0.35 });
    this.playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    const step = (now) => {
      if (this.playing && this.before !== undefined && stage.visible && !stage.held) {
        this.fraction = (this.fraction + Math.min(now - this.before, 100) / 1000 / this.seconds) % 1;
        tick();
        stage.paint();
      }
      this.before = now;
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}

/** A handle of a point in figures. */
export function dot(context, [x, y], radius, fill, stroke, width = 1.5) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  if (fill) {
    context.fillStyle = fill;
    context.fill();
  }
  if (stroke) {
    context.strokeStyle = stroke;
    context.lineWidth = width;
    context.stroke();
  }
}

/** A line through places; an entry without a place interrupts it. */
export function line(context, places, color, width = 2, dash = []) {
  context.beginPath();
  let open = false;
  for (const place of places) {
    if (place) context[open ? "lineTo" : "moveTo"](place[0], place[1]);
    open = Boolean(place);
  }
  context.strokeStyle = color;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.lineCap = dash.length ? "butt" : "round";
  context.stroke();
  context.setLineDash([]);
}
