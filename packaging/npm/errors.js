// The exceptions, with the fields of the Python package.

/** Base class of all errors of symspline. */
export class SymsplineError extends Error {
  constructor(message, { argument = null, index = null, value = null, limit = null } = {}) {
    super(message);
    Object.assign(this, { argument, index, value, limit });
  }
}

/** The input does not meet the requirements. */
export class ValidationError extends SymsplineError {}

/** Two points are not joined by a unique shortest geodesic. */
export class CutLocusError extends SymsplineError {}

/** The solver did not reach the tolerance. */
export class ConvergenceError extends SymsplineError {}

// The names of the classes themselves are shortened by programs that make scripts small.
for (const [name, Class] of Object.entries({ SymsplineError, ValidationError, CutLocusError, ConvergenceError })) {
  Object.defineProperty(Class.prototype, "name", { value: name, configurable: true, writable: true });
}

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
