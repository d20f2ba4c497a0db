// Prints the names that the npm package exports: node exports.mjs PACKAGE

import { pathToFileURL } from "node:url";

console.log(Object.keys(await import(pathToFileURL(`${process.argv[2]}/index.js`))).join(" "));
