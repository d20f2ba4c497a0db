// Arguments as users write them, for the compiled module.

import { ValidationError } from "./errors.js";

const isArray = (x) => Array.isArray(x) || (ArrayBuffer.isView(x) && !(x instanceof DataView));

/** Numbers of a nested array, in order. */
function append(x, numbers, argument, index) {
  if (isArray(x)) {
    for (const entry of x) append(entry, numbers, argument, index);
  } else if (typeof x === "number") {
    numbers.push(x);
  } else {
    throw new ValidationError(`${argument}[${index}] contains ${describe(x)}, but must contain numbers only`, { argument, index });
  }
}

function describe(x) {
  return typeof x === "string" ? JSON.stringify(x) : String(x);
}

/** An array of numbers. */
export function vector(x, argument) {
  if (x instanceof Float64Array) return x;
  if (!isArray(x)) {
    throw new ValidationError(`${argument} must be an array of numbers, not ${describe(x)}`, { argument });
  }
  return Float64Array.from(x, (entry, index) => {
    if (typeof entry === "number") return entry;
    throw new ValidationError(`${argument}[${index}] is ${describe(entry)}, but must be a number`, { argument, index });
  });
}

/** The numbers of one point or tangent vector. */
export function row(x, length, argument, index = null) {
  if (!isArray(x)) {
    throw new ValidationError(`${argument} must be an array of ${length} numbers, not ${describe(x)}`, { argument, index });
  }
  const numbers = [];
  append(x, numbers, argument, index ?? 0);
  if (numbers.length !== length) {
    const which = index === null ? argument : `${argument}[${index}]`;
    const message = `${which} has ${numbers.length} numbers, but points of this space have ${length}`;
    throw new ValidationError(message, { argument, index, value: numbers.length, limit: length });
  }
  return numbers;
}

/** Points: an array of points, or a Float64Array of all their numbers. */
export function rows(points, length, argument = "points") {
  if (points instanceof Float64Array) {
    if (points.length % length === 0) return points;
    const message = `${argument} has ${points.length} numbers, which is not a multiple of ${length}, the length of a point`;
    throw new ValidationError(message, { argument, value: points.length, limit: length });
  }
  if (!isArray(points)) {
    throw new ValidationError(`${argument} must be an array of points, not ${describe(points)}`, { argument });
  }
  const numbers = new Float64Array(points.length * length);
  for (let i = 0; i < points.length; i += 1) numbers.set(row(points[i], length, argument, i), i * length);
  return numbers;
}

/** A number, or undefined for an omitted one. */
export function optional(x, argument) {
  if (x === undefined || x === null) return undefined;
  return number(x, argument);
}

/** A number. */
export function number(x, argument) {
  if (typeof x === "number") return x;
  throw new ValidationError(`${argument} must be a number, not ${describe(x)}`, { argument });
}

/** One of several words. */
export function word(x, argument, words) {
  if (words.includes(x)) return x;
  const known = words.map((w) => JSON.stringify(w)).join(", ");
  throw new ValidationError(`${argument} must be one of ${known}, not ${describe(x)}`, { argument });
}

/** Refuses options that do not exist, which are typing errors. */
export function known(options, names) {
  const argument = Object.keys(options).find((name) => !names.includes(name));
  if (argument === undefined) return;
  throw new ValidationError(`there is no option ${argument}; options are ${names.join(", ")}`, { argument });
}
