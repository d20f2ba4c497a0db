// Starts the figures of the page. `symsplinePlay.mount` puts the globe elsewhere, such as on the front page.

import packed from "embedded:module";
import { init } from "symspline";
import { Construction } from "./construction.js";
import { Globe } from "./globe.js";
import { Rotations } from "./rotations.js";
import { States } from "./states.js";

const FIGURES = { globe: Globe, rotations: Rotations, states: States, construction: Construction };

/** Bytes of the compiled module, which the page contains so that it works without a server. */
async function unpacked() {
  const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

const ready = unpacked().then(init);
const figures = {};

/**
 * Shows the globe in an element, in place of what it contains: a picture for pages without JavaScript, for example.
 * With `bare`, the default, there are neither graphs nor controls.
 */
async function mount(element, { bare = true } = {}) {
  await ready;
  const canvas = document.createElement("canvas");
  canvas.className = "play-canvas";
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "application");
  canvas.setAttribute("aria-label", "A globe with a smooth curve through points that you can drag");
  element.classList.add("play", "play-bare");
  element.replaceChildren(canvas);
  return new Globe(element, { bare });
}

async function start() {
  const roots = [...document.querySelectorAll("[data-figure]")];
  try {
    await ready;
  } catch (error) {
    for (const root of roots) root.querySelector(".play-note").textContent = `This figure could not start: ${error.message}`;
    throw error;
  }
  for (const root of roots) {
    const name = root.dataset.figure;
    figures[name] = new FIGURES[name](root);
    root.classList.add("play-ready");
    performance.mark(`symspline-play-${name}`);
    // The first figure can be used before the others are there.
    await new Promise((resolve) => setTimeout(resolve));
  }
  performance.mark("symspline-play-ready");
}

globalThis.symsplinePlay = { figures, mount, ready };
if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start);
else start();
