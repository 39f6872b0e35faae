// The virtual camera: a perspective view of any size. The field of view runs from outer edge to
// outer edge of the outermost pixels, as in freelook/viewport.py.

import { apply, inverse, matrix, matrixProduct, rotate } from './quaternion.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./quaternion.js').Vector} Vector */
/** @typedef {import('./camera.js').Point} Point */
/** @typedef {{width: number, height: number, hfovDeg: number}} Viewport */

const RAD = Math.PI / 180;

/** @param {Viewport} view @returns {number} */
export const focalPx = (view) => view.width / 2 / Math.tan((view.hfovDeg * RAD) / 2);

/** The viewport whose longer side spans `fieldDeg`: a phone held upright then shows no more than
 * the same phone held sideways.
 * @param {number} width @param {number} height @param {number} fieldDeg @returns {Viewport} */
export function spanning(width, height, fieldDeg) {
  const half = Math.tan((fieldDeg * RAD) / 2) * Math.min(1, width / height);
  return { width, height, hfovDeg: (2 * Math.atan(half)) / RAD };
}

/** View pixel of a ray in the view frame; null behind the view.
 * @param {Viewport} view @param {Vector} ray @returns {Point | null} */
export function project(view, [x, y, z]) {
  if (z < 1e-3) return null;
  const f = focalPx(view);
  return [(view.width - 1) / 2 + (f * x) / z, (view.height - 1) / 2 + (f * y) / z];
}

/** View pixel of a direction relative to the vehicle; null behind the view.
 * @param {Viewport} view @param {Quaternion} headFromView
 * @param {number} yawDeg @param {number} pitchDeg @returns {Point | null} */
export function projectDirection(view, headFromView, yawDeg, pitchDeg) {
  const [yaw, pitch] = [yawDeg * RAD, pitchDeg * RAD];
  /** @type {Vector} */
  const ray = [Math.sin(yaw) * Math.cos(pitch), -Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)];
  return project(view, rotate(inverse(headFromView), ray));
}

/** The border of a view in fisheye pixels, closed; null where the lens does not see.
 * @param {Viewport} view @param {Quaternion} headFromView
 * @param {import('./camera.js').Camera} camera @returns {(Point | null)[]} */
export function outline(view, headFromView, camera, steps = 24) {
  const cameraFromView = matrixProduct(camera.cameraFromHead, matrix(headFromView));
  const f = focalPx(view);
  const [right, bottom] = [view.width / 2 / f, view.height / 2 / f];
  const corners = [[-right, -bottom], [right, -bottom], [right, bottom], [-right, bottom]];
  const points = corners.flatMap(([x, y], side) => {
    const [nextX, nextY] = corners[(side + 1) % 4];
    return Array.from({ length: steps }, (_, i) => {
      const along = i / steps;
      /** @type {Vector} */
      const ray = [x + (nextX - x) * along, y + (nextY - y) * along, 1];
      return camera.project(apply(cameraFromView, ray));
    });
  });
  return [...points, points[0]];
}
