// Plays with the page in headless Chromium, and prints what was seen as JSON.
// node play.mjs TOOLS CHROMIUM PAGE WIDTH PICTURES

import { createRequire } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [tools, executablePath, file, width, pictures] = process.argv.slice(2);
const { chromium } = createRequire(join(tools, "x"))("playwright-core");
const QUIET = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync"];
const browser = await chromium.launch({ executablePath, args: QUIET });
const context = await browser.newContext({ viewport: { width: Number(width), height: 900 }, hasTouch: Number(width) < 600 });
const page = await context.newPage();
const logged = [];
const requests = [];
page.on("console", (message) => {
  if (["error", "warning"].includes(message.type())) logged.push(message.text());
});
page.on("pageerror", (error) => logged.push(error.stack));
page.on("request", (request) => requests.push(request.url()));

const seen = { logged, requests };

/** Runs a function in the page, with the figures first. */
const look = (what, argument) =>
  page.evaluate(([code, value]) => new Function("figures", "value", `return (${code})(figures, value)`)(globalThis.symsplinePlay.figures, value), [
    what.toString(), argument,
  ]);
const settled = () => page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));

async function origin(name) {
  const canvas = page.locator(`[data-figure="${name}"] canvas`);
  await canvas.scrollIntoViewIfNeeded();
  await settled();
  const { x, y } = await canvas.boundingBox();
  return [x, y];
}

/** Drags the pointer from one place of a canvas to another. */
async function drag(name, from, to, steps = 12) {
  const [x, y] = await origin(name);
  await page.mouse.move(x + from[0], y + from[1]);
  await page.mouse.down();
  await page.mouse.move(x + to[0], y + to[1], { steps });
  await settled();
  await page.mouse.up();
  await settled();
}

/** The program of a figure, and the curve that is drawn. */
const shown = (name) =>
  look((figures, which) => {
    const figure = figures[which];
    figure.refresh();
    return { program: figure.program(), x: [...figure.x], points: figure.curve.evaluate(figure.x).map((p) => [...p]) };
  }, name);

// ---- loading ----

await page.goto(pathToFileURL(file).href);
await page.waitForFunction(() => performance.getEntriesByName("symspline-play-ready").length, null, { timeout: 60_000 });
seen.times = await page.evaluate(() =>
  Object.fromEntries(["globe", "ready"].map((name) => [name, performance.getEntriesByName(`symspline-play-${name}`)[0].startTime])));
seen.overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
await look((figures) => Object.values(figures).forEach((figure) => figure.play(false)));
seen.curves = { globe: await shown("globe") };

// ---- the globe ----

const globe = (what, value) => look(what, value);
const place = (index) => globe((figures, i) => figures.globe.places[i], index);
await origin("globe");
const before = await place(2);
const target = [before[0] - 40, before[1] + 55];
await drag("globe", before, target);
seen.dragged = await globe((figures) => {
  const { spline, points, places, t, lonlat } = figures.globe;
  const near = t.slice(1, -1).map((knot) => [1, 2].map((nu) => [-1e-9, 1e-9].map((h) => [...spline.evaluate(knot + h, nu)])));
  const h = 1e-3;
  const differences = t.slice(1, -1).map((knot) => [-1, 1].map((side) => [0, 1, 2, 3].map((k) => [...spline.evaluate(knot + side * k * h)])));
  return { place: places[2], lonlat: lonlat[2], knots: spline.evaluate(t).map((p) => [...p]), points, near, differences, h };
});
seen.dragged.target = target;
seen.curves.dragged = await shown("globe");

seen.globe = await globe((figures) => {
  const { x, motion, naive, geodesics, t, lonlat, ends } = figures.globe;
  const rows = (points) => points.map((p) => [...p]);
  return {
    x: [...x], motion, t, lonlat, ends, naive: { ...naive, places: rows(naive.places) },
    geodesics: { ...geodesics, places: rows(geodesics.places) },
  };
});

// What is under the cursor stays there while the globe turns.
const held = await globe((figures) => {
  const { ball } = figures.globe;
  return [ball.x + 0.5 * ball.radius, ball.y + 0.55 * ball.radius];
});
const grabbed = await globe((figures, at) => figures.globe.ball.unproject(...at), held);
const moved = [held[0] - 60, held[1] - 45];
await drag("globe", held, moved);
seen.turned = await globe((figures, p) => figures.globe.ball.project(p), grabbed);
seen.turned = { place: seen.turned, target: moved };

// A knot on the time axis.
const knot = await globe((figures) => {
  const { chart, t } = figures.globe;
  return { from: [chart.toX(t[1]), chart.axis], to: [chart.toX(t[1] + 3), chart.axis] };
});
await drag("globe", knot.from, knot.to);
seen.times.knot = await globe((figures) => figures.globe.t[1]);

// Keys, and double clicks.
await page.locator('[data-figure="globe"] canvas').focus();
const state = () => globe((figures) => ({ lonlat: figures.globe.lonlat.map((p) => [...p]), t: [...figures.globe.t], selected: figures.globe.selected }));
seen.keys = [await state()];
for (const key of ["ArrowUp", "n", "a", "Delete", "]"]) {
  await page.keyboard.press(key);
  await settled();
  seen.keys.push({ key, ...(await state()) });
}
const [ox, oy] = await origin("globe");
const empty = await globe((figures) => [figures.globe.ball.x, figures.globe.ball.y + 0.8 * figures.globe.ball.radius]);
await page.mouse.dblclick(ox + empty[0], oy + empty[1]);
await settled();
seen.added = await state();

// Frames while a point is dragged in circles.
seen.frames = await frames();
async function frames() {
  await page.click('[data-figure="globe"] [data-play="reset"]');
  await look((figures) => figures.globe.play(false));
  const [x, y] = await origin("globe");
  const [px, py] = await place(2);
  await page.mouse.move(x + px, y + py);
  await page.mouse.down();
  await page.evaluate(() => {
    const { stage } = globalThis.symsplinePlay.figures.globe;
    const canvas = stage.canvas;
    const paint = stage.paint.bind(stage);
    globalThis.seen = { frames: [], costs: [] };
    stage.paint = () => {
      const start = performance.now();
      paint();
      globalThis.seen.costs.push(performance.now() - start);
    };
    const step = (now) => {
      globalThis.seen.frames.push(now);
      // A pointer that moves once per frame, as a hand does.
      const k = globalThis.seen.frames.length / 20;
      const box = canvas.getBoundingClientRect();
      const event = { pointerId: 1, clientX: box.left + globalThis.center[0] + 30 * Math.sin(k), clientY: box.top + globalThis.center[1] + 30 * Math.cos(k) };
      canvas.dispatchEvent(new PointerEvent("pointermove", event));
      if (now - globalThis.seen.frames[0] < 2000) requestAnimationFrame(step);
      else globalThis.seen.done = true;
    };
    const [cx, cy] = globalThis.symsplinePlay.figures.globe.places[2];
    globalThis.center = [cx, cy];
    requestAnimationFrame(step);
  });
  await page.waitForFunction(() => globalThis.seen.done, null, { timeout: 30_000 });
  await page.mouse.up();
  return page.evaluate(() => {
    const { frames: all, costs } = globalThis.seen;
    costs.sort((a, b) => a - b);
    return {
      perSecond: ((all.length - 1) / (all.at(-1) - all[0])) * 1000, median: costs[costs.length >> 1],
      slow: costs[Math.floor(costs.length * 0.95)], count: costs.length,
    };
  });
}

// Noise and smoothing.
const slide = (name, value) =>
  page.evaluate(([which, x]) => {
    const control = document.querySelector(`[data-figure="globe"] [data-play="${which}"]`);
    if (control.type === "checkbox") control.checked = x;
    else control.value = x;
    control.dispatchEvent(new Event(control.type === "checkbox" ? "change" : "input"));
  }, [name, value]);
await slide("noise", 3);
await settled();
seen.curves.noisy = await shown("globe");
await page.locator('[data-figure="globe"]').screenshot({ path: join(pictures, `noisy-${width}.png`) });
await slide("auto", false);
await slide("lam", 0.5);
await settled();
seen.curves.smooth = await shown("globe");
await slide("noise", 0);

// Neighbours at opposite ends of the Earth: there is no curve, and a message that says so.
seen.antipodes = await globe((figures) => {
  const { globe: figure } = figures;
  const kept = [...figure.lonlat[1]];
  figure.lonlat[1] = [figure.lonlat[0][0] - 180, -figure.lonlat[0][1]];
  figure.changed();
  figure.refresh();
  figure.stage.paint();
  const message = figure.note.textContent;
  figure.lonlat[1] = kept;
  figure.changed();
  figure.refresh();
  return { message, after: figure.note.textContent };
});

// ---- the other figures ----

seen.curves.rotations = await shown("rotations");
const main = await look((figures) => figures.rotations.main);
await drag("rotations", [main[0], main[1]], [main[0] + 40, main[1] - 60]);
seen.curves.turned = await shown("rotations");
seen.rotations = await look((figures) => {
  const { x, motion, eulerMotion, slerp, t } = figures.rotations;
  const times = [...x].filter((_, i) => i % 13 === 6);
  const h = 1e-5;
  return {
    x: [...x], t, motion, euler: eulerMotion, slerp, times, h, at: times.map((time) => figures.rotations.at(time).map((m) => [...m])),
    near: times.map((time) => [-h, h].map((step) => figures.rotations.at(time + step)[2])),
  };
});
await page.click('[data-figure="rotations"] [data-play="up"]');
await settled();
seen.curves.up = await shown("rotations");
await page.locator('[data-figure="rotations"]').screenshot({ path: join(pictures, `up-${width}.png`) });
await origin("states");
const state1 = await look((figures) => figures.states.kind.places[1]);
await drag("states", state1, [state1[0] + 25, state1[1] + 30]);
seen.curves.bloch = await shown("states");
seen.field = await look((figures) => figures.states.kind.field);
await page.click('[data-play="ellipses"]');
await settled();
await origin("states");
const tip = await look((figures) => ({ from: figures.states.kind.handles[2].tips[1], at: figures.states.kind.handles[2].at }));
await drag("states", tip.from, [tip.at[0] + 12, tip.at[1] + 20]);
seen.curves.ellipses = await shown("states");
seen.area = await look((figures) => figures.states.kind.area[0]);
for (const kind of ["plane", "sphere", "disk"]) {
  await page.click(`[data-play="${kind}"]`);
  await settled();
  await origin("construction");
  const from = await look((figures) => figures.construction.places[1]);
  await drag("construction", from, [from[0] + 20, from[1] + 30]);
  seen.curves[kind] = await shown("construction");
}
seen.construction = await look((figures) => {
  const figure = figures.construction;
  figure.moveCursor(1.4);
  return { made: [...figure.levels().levels[3][0]], curve: [...figure.spline.evaluate(figure.cursor)] };
});

// ---- a globe on another page, dark colours, copying ----

seen.hero = await page.evaluate(async () => {
  const element = document.createElement("div");
  element.style.width = "320px";
  element.innerHTML = "<img alt='A globe' src='data:,'>";
  document.body.append(element);
  const hero = await globalThis.symsplinePlay.mount(element);
  await new Promise((resolve) => setTimeout(resolve, 100));
  const found = { pictures: element.querySelectorAll("img").length, width: hero.stage.width, points: hero.places.length };
  element.remove();
  return found;
});
await page.locator('[data-figure="globe"] details summary').click();
seen.code = await page.locator('[data-figure="globe"] code').textContent();
await page.click('[data-figure="globe"] .play-copy');
await page.emulateMedia({ colorScheme: "dark" });
await settled();
await page.screenshot({ path: join(pictures, `page-${width}.png`), fullPage: true });
await browser.close();
process.stdout.write(JSON.stringify(seen));
