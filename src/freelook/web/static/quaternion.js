// Rotations as unit quaternions [w, x, y, z], and head angles in degrees.
//
// Axes: x right, y down, z forward. Yaw + right, pitch + up, roll + right ear down, applied in
// that order: R_y(yaw) R_x(pitch) R_z(roll). The same conventions as freelook/rotations.py.

/** @typedef {[number, number, number, number]} Quaternion (w, x, y, z) */
/** @typedef {[number, number, number]} Vector */
/** @typedef {{yaw: number, pitch: number, roll: number}} Angles degrees */

const RAD = Math.PI / 180;

/** @type {Quaternion} */
export const IDENTITY = [1, 0, 0, 0];

/** @param {Quaternion} a @param {Quaternion} b @returns {Quaternion} a after b */
export function multiply([aw, ax, ay, az], [bw, bx, by, bz]) {
  return [
    aw * bw - ax * bx - ay * by - az * bz,
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
  ];
}

/** @param {Quaternion} q @returns {Quaternion} */
export const inverse = ([w, x, y, z]) => [w, -x, -y, -z];

/** @param {number[]} q @returns {Quaternion | null} unit length, or null where it has none */
export function normalised(q) {
  const length = Math.hypot(...q);
  if (q.length !== 4 || !Number.isFinite(length) || length < 1e-9) return null;
  return /** @type {Quaternion} */ (q.map((value) => value / length));
}

/** @param {0 | 1 | 2} axis x, y or z @param {number} degrees @returns {Quaternion} */
export function about(axis, degrees) {
  const q = /** @type {Quaternion} */ ([Math.cos((degrees * RAD) / 2), 0, 0, 0]);
  q[axis + 1] = Math.sin((degrees * RAD) / 2);
  return q;
}

/** @param {Angles} angles @returns {Quaternion} */
export const fromAngles = ({ yaw, pitch, roll }) =>
  multiply(about(1, yaw), multiply(about(0, pitch), about(2, roll)));

/** Rows of the 3 x 3 matrix, one after the other. @param {Quaternion} q @returns {number[]} */
export function matrix([w, x, y, z]) {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
    2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
  ];
}

/**
 * Yaw and roll in (-180, 180], pitch in [-90, 90]. Straight up or down, where yaw and roll turn
 * about the same axis, roll is 0.
 * @param {Quaternion} q @returns {Angles}
 */
export function toAngles(q) {
  const [xx, , xz, yx, yy, yz, zx, , zz] = matrix(q);
  const pitch = Math.asin(Math.max(-1, Math.min(1, -yz))) / RAD;
  if (Math.abs(yz) > 1 - 1e-9) return { yaw: Math.atan2(-zx, xx) / RAD, pitch, roll: 0 };
  return { yaw: Math.atan2(xz, zz) / RAD, pitch, roll: Math.atan2(yx, yy) / RAD };
}

/** About a unit axis. @param {Vector} axis @param {number} angle radians @returns {Quaternion} */
export const turned = ([x, y, z], angle) => {
  const sine = Math.sin(angle / 2);
  return [Math.cos(angle / 2), x * sine, y * sine, z * sine];
};

/** Radians of the rotation that leads from a to b. @param {Quaternion} a @param {Quaternion} b */
export function angleBetween(a, b) {
  const [w, x, y, z] = multiply(inverse(a), b);
  return 2 * Math.atan2(Math.hypot(x, y, z), Math.abs(w));
}

/** @param {Quaternion} q @param {Vector} v @returns {Vector} */
export const rotate = (q, v) => apply(matrix(q), v);

/** @param {number[]} m rows of a 3 x 3 matrix @param {Vector} v @returns {Vector} */
export function apply(m, [x, y, z]) {
  return [
    m[0] * x + m[1] * y + m[2] * z,
    m[3] * x + m[4] * y + m[5] * z,
    m[6] * x + m[7] * y + m[8] * z,
  ];
}

/** @param {number[]} a @param {number[]} b rows of 3 x 3 matrices @returns {number[]} a b */
export function matrixProduct(a, b) {
  return Array.from({ length: 9 }, (_, i) => {
    const [row, column] = [3 * Math.floor(i / 3), i % 3];
    return a[row] * b[column] + a[row + 1] * b[column + 3] + a[row + 2] * b[column + 6];
  });
}

/** The short way from a (0) to b (1). @param {Quaternion} a @param {Quaternion} b
 * @param {number} fraction @returns {Quaternion} */
export function slerp(a, b, fraction) {
  const dot = a.reduce((sum, value, i) => sum + value * b[i], 0);
  const near = /** @type {Quaternion} */ (dot < 0 ? b.map((value) => -value) : b);
  const angle = Math.acos(Math.min(1, Math.abs(dot)));
  if (angle < 1e-6) return near;
  const [from, to] = [Math.sin((1 - fraction) * angle), Math.sin(fraction * angle)];
  return /** @type {Quaternion} */ (
    a.map((value, i) => (from * value + to * near[i]) / Math.sin(angle))
  );
}

/** @param {number} degrees @returns {number} the same direction in (-180, 180] */
export const wrapped = (degrees) => degrees - 360 * Math.ceil((degrees - 180) / 360);
