// Builds the npm package in build/npm and the page of figures in build/play, from the module that cargo compiled.
// node packaging/npm/build.mjs MODULE WASM_BINDGEN; `make wasm` calls it.

import { execFileSync } from "node:child_process";
import { cpSync, existsSync, mkdirSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { brotliCompressSync, gzipSync } from "node:zlib";

const ROOT = resolve(dirname(fileURLToPath(import.meta.url)), "../..");
const at = (...names) => join(ROOT, ...names);
const [module, bindgen] = process.argv.slice(2);
const { build } = createRequire(at("build/node/"))("esbuild");
const PACKAGE = at("build/npm");
const LICENCES = "THIRD-PARTY-LICENSES.txt";
const LIMITS = { module: 600e3, page: 1e6 };

/** Refuses files that are too large as servers transfer them today, with Brotli; prints the size with gzip as well. */
function check(name, files, limit) {
  const size = (compress) => files.reduce((sum, file) => sum + compress(readFileSync(file)).length, 0);
  const [brotli, gzip] = [size(brotliCompressSync), size((bytes) => gzipSync(bytes, { level: 9 }))];
  console.log(`${name}: ${Math.round(gzip / 1000)} kB with gzip, ${Math.round(brotli / 1000)} kB with Brotli`);
  if (brotli > limit) throw new Error(`${name} has ${brotli} bytes with Brotli, more than ${limit}`);
}

function makePackage() {
  rmSync(PACKAGE, { recursive: true, force: true });
  mkdirSync(PACKAGE, { recursive: true });
  const options = ["--target", "web", "--no-typescript", "--out-dir", PACKAGE, "--out-name", "symspline", module];
  execFileSync(bindgen, options, { stdio: "inherit" });
  const wasm = join(PACKAGE, "symspline_bg.wasm");
  const features = ["simd", "bulk-memory", "sign-ext", "mutable-globals", "nontrapping-float-to-int", "reference-types", "multivalue"];
  const optimizer = at("build/node/node_modules/binaryen/bin/wasm-opt");
  execFileSync(process.execPath, [optimizer, "-Os", "-Oz", ...features.map((name) => `--enable-${name}`), wasm, "-o", wasm]);
  for (const name of ["package.json", "index.js", "input.js", "errors.js", "index.d.ts", "README.md"]) {
    cpSync(at("packaging/npm", name), join(PACKAGE, name));
  }
  cpSync(at("LICENSE"), join(PACKAGE, "LICENSE"));
  cpSync(at("build/node", LICENCES), join(PACKAGE, LICENCES));
  check("module", [wasm], LIMITS.module);
}

/** The bytes of the module as text, compressed, so that the page works without a server. */
const embedded = {
  name: "embedded",
  setup(builder) {
    builder.onResolve({ filter: /^embedded:module$/ }, () => ({ path: "module", namespace: "embedded" }));
    builder.onLoad({ filter: /.*/, namespace: "embedded" }, () => {
      const bytes = gzipSync(readFileSync(join(PACKAGE, "symspline_bg.wasm")), { level: 9 });
      return { contents: `export default ${JSON.stringify(bytes.toString("base64"))}`, loader: "js" };
    });
  },
};

async function makePage() {
  const out = at("build/play");
  mkdirSync(out, { recursive: true });
  await build({
    entryPoints: [at("docs/play/main.js")], outfile: join(out, "play.js"), bundle: true, minify: true, format: "iife",
    target: "es2022", charset: "utf8", legalComments: "none", alias: { symspline: join(PACKAGE, "index.js") },
    plugins: [embedded], logOverride: { "empty-import-meta": "silent" },
  });
  await build({ entryPoints: [at("docs/play/play.css")], outfile: join(out, "play.css"), minify: true });
  const body = readFileSync(at("docs/play/body.html"), "utf8").replaceAll("_static/play/", "");
  const frame = readFileSync(at("docs/play/standalone.html"), "utf8");
  writeFileSync(join(out, "index.html"), frame.replace("<!-- body -->", () => body));
  // The site finds them here.
  const site = at("docs/_static/play");
  mkdirSync(site, { recursive: true });
  // The page contains the compiled module.
  cpSync(join(PACKAGE, LICENCES), join(out, LICENCES));
  for (const name of ["play.js", "play.css", LICENCES]) cpSync(join(out, name), join(site, name));
  check("page", ["play.js", "play.css", "index.html"].map((name) => join(out, name)), LIMITS.page);
}

if (module !== "page") makePackage();
if (!existsSync(join(PACKAGE, "symspline_bg.wasm")) || !statSync(PACKAGE).isDirectory()) throw new Error("run `make wasm` first");
await makePage();
