// Opens every page of the built site in Chromium and reports what a reader would stumble over: `make docs-check`.
//
// On a screen of 390 pixels: elements wider than the screen outside of a scroll box of their own, clipped text and numbers
// that break inside a table cell. At 1280 pixels: lines of text longer than 85 characters. On both: formulas that KaTeX
// refuses, images without alternative text, errors in the console and requests to other hosts. Ten pages are checked for
// accessibility by axe-core, in the light and in the dark mode.
//
//   node docs/check_pages.mjs SITE TOOLS [PART OF A PATH]
//
// TOOLS is a folder in which npm has installed playwright-core and axe-core. CHROMIUM is the browser's executable.

import { readdirSync, readFileSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import { join, relative, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [site, tools, part = ""] = [resolve(process.argv[2]), resolve(process.argv[3]), process.argv[4]];
const require = createRequire(join(tools, "package.json"));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const ACCESSIBLE = [
  "index.html", "start.html", "paper.html", "theorem.html", "solvers.html", "guide/ends.html", "api/index.html",
  "api/generated/symspline.CubicSpline.html", "gallery/index.html", "theory/index.html",
];
const MOST_CHARACTERS = 85;

function pagesBelow(folder) {
  return readdirSync(folder).sort().flatMap((name) => {
    const path = join(folder, name);
    if (statSync(path).isDirectory()) return name === "_static" ? [] : pagesBelow(path);
    return name.endsWith(".html") ? [path] : [];
  });
}

// Runs in the page. Returns one line per problem of a narrow screen.
function narrowProblems() {
  const width = document.documentElement.clientWidth;
  const found = [];
  const shown = (element) => `${element.tagName.toLowerCase()}.${element.className} "${element.textContent.trim().slice(0, 40)}"`;
  const scrolls = (element) => {
    // The theme makes the whole article a scroll box.
    for (let box = element; box && !box.matches(".bd-article-container, body"); box = box.parentElement) {
      if (["auto", "scroll"].includes(getComputedStyle(box).overflowX)) return true;
    }
    return false;
  };
  // Text for screen readers only is clipped on purpose.
  const hidden = (element) => !element.checkVisibility({ visibilityProperty: true }) ||
    element.closest("[aria-hidden=true], .visually-hidden, .sphx-glr-thumbcontainer p a, .katex-mathml, .skip-link, svg, dialog");
  for (const element of document.querySelectorAll("body *")) {
    if (hidden(element)) continue;
    const box = element.getBoundingClientRect();
    if (box.width > 1 && (box.right > width + 1 || box.left < -1) && !scrolls(element.parentElement)) {
      // A box that scrolls must itself fit; the innermost culprit is the useful message.
      if (![...element.children].some((child) => child.getBoundingClientRect().right > width + 1)) {
        found.push(`wider than the screen: ${shown(element)}`);
      }
    }
    const style = getComputedStyle(element);
    if (style.overflowX === "hidden" && style.textOverflow !== "ellipsis" && element.scrollWidth > element.clientWidth + 1 && element.textContent.trim()) {
      found.push(`clipped: ${shown(element)}`);
    }
  }
  if (document.documentElement.scrollWidth > width + 1) found.push("the page scrolls sideways");
  for (const cell of document.querySelectorAll("td, th")) {
    const walker = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
    for (let node; (node = walker.nextNode());) {
      if (node.parentElement.closest("code, pre, .katex")) continue;
      for (const number of node.data.matchAll(/[-+−]?\d(?:[\d.,·e−+-]*\d)?%?/g)) {
        const range = document.createRange();
        range.setStart(node, number.index);
        range.setEnd(node, number.index + number[0].length);
        if (new Set([...range.getClientRects()].map((box) => Math.round(box.top))).size > 1) {
          found.push(`broken number: ${number[0]}`);
        }
      }
    }
  }
  return found;
}

// Runs in the page. Returns one line per problem that does not depend on the width, and the longest line of text.
function wideProblems() {
  const found = [];
  for (const error of document.querySelectorAll(".katex-error")) found.push(`formula: ${error.title}`);
  for (const math of document.querySelectorAll(".math")) {
    if (!math.matches(".katex-error") && !math.querySelector(".katex")) found.push(`formula not typeset: ${math.textContent}`);
  }
  for (const image of document.querySelectorAll("article img")) {
    // A thumbnail stands above its title.
    if (!image.alt.trim() && !image.closest(".sphx-glr-thumbcontainer")) found.push(`no alternative text: ${image.getAttribute("src")}`);
  }
  let longest = 0;
  for (const text of document.querySelectorAll("article p, article li")) {
    const range = document.createRange();
    range.selectNodeContents(text);
    const tops = [...range.getClientRects()].map((box) => Math.round(box.bottom / 8));
    const lines = new Set(tops).size;
    if (lines >= 4 && !text.querySelector("ul, ol, table, pre, .katex, code")) {
      longest = Math.max(longest, text.textContent.length / lines);
    }
  }
  return [found, Math.round(longest)];
}

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--allow-file-access-from-files"],
});
const problems = new Set();
const report = (name, lines) => {
  for (const line of lines) console.log(`${name}: ${line}`);
  if (lines.length) problems.add(name);
};
const paths = pagesBelow(site).filter((path) => path.includes(part));
let longest = 0;
const context = await browser.newContext();
const page = await context.newPage();
let current = "";
page.on("console", (message) => message.type() === "error" && report(current, [`console: ${message.text()}`]));
page.on("pageerror", (error) => report(current, [`error: ${error.message}`]));
page.on("request", (request) => /^https?:/.test(request.url()) && report(current, [`request: ${request.url()}`]));
for (const path of paths) {
  current = relative(site, path);
  await page.setViewportSize({ width: 1280, height: 900 });
  await page.goto(pathToFileURL(path).href, { waitUntil: "load" });
  const [found, characters] = await page.evaluate(wideProblems);
  longest = Math.max(longest, characters);
  if (characters > MOST_CHARACTERS) found.push(`lines of ${characters} characters`);
  report(current, found);
  await page.setViewportSize({ width: 390, height: 844 });
  report(current, [...new Set(await page.evaluate(narrowProblems))].slice(0, 8));
}
let checked = 0;
for (const name of ACCESSIBLE) {
  const path = join(site, name);
  if (!paths.includes(path)) continue;
  checked += 1;
  for (const colorScheme of ["light", "dark"]) {
    // Colours that are still changing, as buttons do when the theme is set, would be measured on their way.
    await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
    await page.setViewportSize({ width: 1280, height: 900 });
    current = name;
    await page.goto(pathToFileURL(path).href, { waitUntil: "load" });
    await page.evaluate(axe);
    const { violations } = await page.evaluate(() => globalThis.axe.run());
    report(`${name} (${colorScheme})`, violations.map(({ id, help, nodes }) =>
      `axe ${id}: ${help} (${nodes.length}, ${nodes[0].target.join(" ")})`));
  }
}
await browser.close();
console.log(`${paths.length} pages, ${checked} of them by axe-core; ${problems.size} with problems; ` +
  `longest lines ${longest} characters on average over a paragraph`);
process.exit(problems.size ? 1 : 0);
