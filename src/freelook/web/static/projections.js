// The projections of a view: rays through places, and places of rays. A place [x, y] is counted from
// the middle of the view in focal lengths. The definition is in freelook/projections.py; the limits
// of the field come from the station.

/** @typedef {import('./quaternion.js').Vector} Vector */
/** @typedef {[number, number]} Place */

const { atan2, cos, hypot, sin } = Math;

/** @type {Record<string, (x: number, y: number) => Vector>} */
export const RAYS = {
  perspective: (x, y) => [x, y, 1],
  pannini: (x, y) => [x, y, 1 - (x * x) / 4],
  stereographic: (x, y) => [x, y, 1 - (x * x + y * y) / 4],
  cylindrical: (x, y) => [sin(x), y, cos(x)],
  equirectangular: (x, y) => [sin(x) * cos(y), sin(y), cos(x) * cos(y)],
  equidistant: (x, y) => {
    const angle = hypot(x, y);
    const sinc = angle > 1e-9 ? sin(angle) / angle : 1;
    return [x * sinc, y * sinc, cos(angle)];
  },
};

/** null where the projection has no place for a ray.
 * @type {Record<string, (ray: Vector) => Place | null>} */
const PLACES = {
  perspective: ([x, y, z]) => over(x, y, z),
  pannini: ([x, y, z]) => over(x, y, (hypot(x, z) + z) / 2),
  stereographic: ([x, y, z]) => over(x, y, (hypot(x, y, z) + z) / 2),
  cylindrical: ([x, y, z]) => {
    const place = over(0, y, hypot(x, z));
    return place && [atan2(x, z), place[1]];
  },
  equirectangular: ([x, y, z]) => [atan2(x, z), atan2(y, hypot(x, z))],
  equidistant: ([x, y, z]) => {
    const sine = hypot(x, y);
    const scale = sine > 1e-12 ? atan2(sine, z) / sine : 1;
    return [x * scale, y * scale];
  },
};

/** @param {number} x @param {number} y @param {number} below @returns {Place | null} */
const over = (x, y, below) => (below < 1e-3 ? null : [x / below, y / below]);

/** Which formula each projection has, and what the shader calls it.
 * @type {Record<string, {formula: string, define?: string, tallestDeg?: number}>} */
export const PROJECTIONS = {
  perspective: { formula: 'perspective' },
  pannini: { formula: 'pannini', define: 'PANNINI' },
  stereographic: { formula: 'stereographic', define: 'STEREOGRAPHIC' },
  cylindrical: { formula: 'cylindrical', define: 'CYLINDRICAL' },
  equirectangular: { formula: 'equirectangular', define: 'EQUIRECTANGULAR', tallestDeg: 180 },
  strip: { formula: 'equirectangular', define: 'EQUIRECTANGULAR', tallestDeg: 90 },
  crop: { formula: 'equidistant', define: 'CUT' },
};

/** @param {string} projection @param {number} x @param {number} y @returns {Vector} */
export const rayOf = (projection, x, y) => RAYS[PROJECTIONS[projection].formula](x, y);

/** @param {string} projection @param {Vector} ray @returns {Place | null} */
export const placeOf = (projection, ray) => PLACES[PROJECTIONS[projection].formula](ray);

/** x of the direction `half` to the right, in focal lengths. @param {string} projection
 * @param {number} half radians @returns {number} */
export const halfWidth = (projection, half) =>
  (placeOf(projection, [sin(half), 0, cos(half)]) ?? [Infinity])[0];

/** How far to the right a place beside the middle looks, radians; the reverse of `halfWidth`.
 * @param {string} projection @param {number} x @returns {number} */
export function halfAngle(projection, x) {
  const [right, , ahead] = rayOf(projection, x, 0);
  return atan2(right, ahead);
}
