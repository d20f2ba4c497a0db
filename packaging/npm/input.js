// Arguments as users write them, for the compiled module.

import { inFactor, ValidationError } from "./errors.js";

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

/** Calls a function for each factor of a space. Exceptions name the factor of a product. */
export function forFactors({ factors }, call) {
  if (factors.length === 1) return [call(factors[0], 0)];
  return factors.map((factor, k) => inFactor(k, factor.name, () => call(factor, k)));
}

/** Calls a function for each factor of a space, with the entry of an argument that belongs to it. */
export function inFactors(x, space, argument, call) {
  const count = space.factors.length;
  if (count > 1 && (!Array.isArray(x) || x.length !== count)) {
    const message = `${argument} must be an array of ${count} arrays, one per factor of the space`;
    throw new ValidationError(message, { argument, value: x?.length ?? null, limit: count });
  }
  return forFactors(space, (factor, k) => call(count > 1 ? x[k] : x, factor));
}

/** One array with the numbers of each point in the first factor, then those in the second one, and so on. */
function joined(parts, space) {
  if (parts.length === 1) return parts[0];
  const count = parts[0].length / space.factors[0].length;
  const numbers = new Float64Array(count * space.length);
  let start = 0;
  for (const [k, { length }] of space.factors.entries()) {
    for (let i = 0; i < count; i += 1) numbers.set(parts[k].slice(i * length, (i + 1) * length), i * space.length + start);
    start += length;
  }
  return numbers;
}

/** The numbers of one tangent vector, in all factors. */
export function joinedRow(x, space, argument, index) {
  const parts = inFactors(x, space, argument, (part, factor) => row(part, factor.length, argument, index));
  return Float64Array.from(joined(parts, space));
}

/** The numbers of points, in all factors. */
export function joinedRows(points, space) {
  const parts = inFactors(points, space, "points", (part, factor) => rows(part, factor.length));
  const counts = parts.map((part, k) => part.length / space.factors[k].length);
  if (counts.some((count) => count !== counts[0])) {
    const message = `the factors of points have different lengths: ${counts.join(", ")}. Pass as many points for each factor`;
    throw new ValidationError(message, { argument: "points" });
  }
  return joined(parts, space);
}

/** Points: an array of points, or a Float64Array of all their numbers. */
function rows(points, length, argument = "points") {
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

/** Numbers for all factors of a space or for each of them, NaN for an omitted one. */
export function perFactor(x, argument, { factors }) {
  const values = factors.length > 1 && isArray(x) ? x : [x];
  return Float64Array.from(values, (value) => {
    if (value === undefined || value === null) return NaN;
    if (!Number.isNaN(value)) return number(value, argument);
    throw new ValidationError(`${argument} must be a number, not NaN`, { argument, value });
  });
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
