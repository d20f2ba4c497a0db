// The exceptions, with the fields of the Python package.

/** Base class of all errors of symspline. */
export class SymsplineError extends Error {
  constructor(message, { argument = null, index = null, value = null, limit = null, factor = null } = {}) {
    super(message);
    Object.assign(this, { argument, index, value, limit, factor });
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
    const { message, argument, index, value, limit, factor } = fault;
    fault.free();
    throw new Class(message, { argument, index, value, limit, factor });
  }
}

/** Calls a function for one factor of a product, whose exceptions name the factor. */
export function inFactor(factor, name, call) {
  try {
    return call();
  } catch (error) {
    if (!(error instanceof SymsplineError)) throw error;
    throw new error.constructor(`factor ${factor}, ${name}: ${error.message}`, { ...error, factor });
  }
}
