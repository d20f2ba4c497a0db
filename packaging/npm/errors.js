// The exceptions, with the fields of the Python package.

/** Base class of all errors of symspline. */
export class SymsplineError extends Error {
  constructor(message, { argument = null, index = null, value = null, limit = null } = {}) {
    super(message);
    this.name = new.target.name;
    this.argument = argument;
    this.index = index;
    this.value = value;
    this.limit = limit;
  }
}

/** The input does not meet the requirements. */
export class ValidationError extends SymsplineError {}

/** Two points are not joined by a unique shortest geodesic. */
export class CutLocusError extends SymsplineError {}

/** The solver did not reach the tolerance. */
export class ConvergenceError extends SymsplineError {}

const CLASSES = { validation: ValidationError, "cut-locus": CutLocusError, convergence: ConvergenceError };

/** Calls a function of the compiled module, and turns a fault into an exception. */
export function checked(call) {
  try {
    return call();
  } catch (fault) {
    const Class = CLASSES[fault?.kind];
    if (!Class) throw fault;
    const { message, argument, index, value, limit } = fault;
    fault.free();
    throw new Class(message, { argument: argument ?? null, index: index ?? null, value: value ?? null, limit: limit ?? null });
  }
}
