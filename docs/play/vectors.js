// Vectors and 3 × 3 matrices, as arrays; matrices row by row.

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const norm = (a) => Math.hypot(...a);
export const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const unit = (a) => scaled(a, 1 / norm(a));
export const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];

export const apply = (m, v) => [
  m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
  m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
  m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
];
export const transposed = (m) => [m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]];

export function product(a, b) {
  const out = new Array(9);
  for (let i = 0; i < 3; i += 1) {
    for (let j = 0; j < 3; j += 1) out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  }
  return out;
}

/** The rotation by the length of a vector about its direction (Rodrigues' formula). */
export function turn([x, y, z]) {
  const angle = Math.hypot(x, y, z);
  const s = angle < 1e-8 ? 1 : Math.sin(angle) / angle;
  const c = angle < 1e-4 ? 0.5 : (1 - Math.cos(angle)) / angle ** 2;
  return [
    1 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y,
    c * x * y + s * z, 1 - c * (x * x + z * z), c * y * z - s * x,
    c * x * z - s * y, c * y * z + s * x, 1 - c * (x * x + y * y),
  ];
}

/** The vector of a rotation, the inverse of `turn`, by way of its quaternion, which is exact near half turns. */
export function turnVector(m) {
  const q = quaternion(m);
  const size = Math.hypot(q[0], q[1], q[2]);
  const angle = 2 * Math.atan2(size, q[3]);
  return scaled(q, size < 1e-12 ? 2 : angle / size).slice(0, 3);
}

/** The quaternion x, y, z, w of a rotation, with w >= 0 (Shepperd's method). */
function quaternion(m) {
  const trace = m[0] + m[4] + m[8];
  const q = [
    [m[7] - m[5], m[2] - m[6], m[3] - m[1], 1 + trace],
    [1 + 2 * m[0] - trace, m[1] + m[3], m[2] + m[6], m[7] - m[5]],
    [m[1] + m[3], 1 + 2 * m[4] - trace, m[5] + m[7], m[2] - m[6]],
    [m[2] + m[6], m[5] + m[7], 1 + 2 * m[8] - trace, m[3] - m[1]],
  ][[trace, m[0], m[4], m[8]].reduce((best, x, i, all) => (x > all[best] ? i : best), 0)];
  const size = Math.hypot(...q) * (q[3] < 0 ? -1 : 1);
  return q.map((x) => x / size);
}

/** The shortest rotation from one unit vector to another. */
export function between(a, b) {
  const axis = cross(a, b);
  const size = norm(axis);
  return turn(size < 1e-12 ? [0, 0, 0] : scaled(axis, Math.atan2(size, dot(a, b)) / size));
}

/** `count` numbers from `start` to `end`, both included exactly. */
export const linspace = (start, end, count) =>
  Float64Array.from({ length: count }, (_, i) => (i === count - 1 ? end : start + ((end - start) * i) / (count - 1)));

export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
export const rounded = (x, digits) => Math.round(x * 10 ** digits) / 10 ** digits;

const RADIANS = Math.PI / 180;

/** The unit vector of a longitude and a latitude in degrees. */
export function fromLonlat([lon, lat]) {
  const [l, p] = [lon * RADIANS, lat * RADIANS];
  return [Math.cos(p) * Math.cos(l), Math.cos(p) * Math.sin(l), Math.sin(p)];
}

/** Longitude and latitude of a unit vector, to a hundredth of a degree. */
export const toLonlat = ([x, y, z]) => [
  rounded(Math.atan2(y, x) / RADIANS, 2), rounded(Math.atan2(z, Math.hypot(x, y)) / RADIANS, 2),
];
