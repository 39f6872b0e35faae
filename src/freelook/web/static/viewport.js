// The virtual camera: a view of any size and projection. The field of view runs from outer edge to
// outer edge of the outermost pixels, as in freelook/viewport.py.

import { halfAngle, halfWidth, placeOf, PROJECTIONS, rayOf } from './projections.js';
import { apply, inverse, matrix, matrixProduct, rotate } from './quaternion.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./quaternion.js').Vector} Vector */
/** @typedef {import('./camera.js').Point} Point */
/** @typedef {{width: number, height: number, hfovDeg: number, projection?: string}} Viewport
 * perspective where no projection is named */

const RAD = Math.PI / 180;

/** @param {Viewport} view */
export const projectionOf = (view) => view.projection ?? 'perspective';

/** Pixels per radian in the middle. @param {Viewport} view @returns {number} */
export const focalPx = (view) =>
  view.width / 2 / halfWidth(projectionOf(view), (view.hfovDeg * RAD) / 2);

/** The viewport whose longer side spans `fieldDeg`: a phone held upright then shows no more than
 * the same phone held sideways. Where a projection may only be so high, it is the width that does.
 * @param {number} width @param {number} height @param {number} fieldDeg
 * @param {string} projection @returns {Viewport} */
export function spanning(width, height, fieldDeg, projection = 'perspective') {
  if (PROJECTIONS[projection].tallestDeg) return { width, height, hfovDeg: fieldDeg, projection };
  const half = halfWidth(projection, (fieldDeg * RAD) / 2) * Math.min(1, width / height);
  return { width, height, hfovDeg: (2 * halfAngle(projection, half)) / RAD, projection };
}

/** The part of a pane that a view of this projection may fill: its whole width, and as much of its
 * height as the projection has. @template {{y: number, width: number, height: number}} T
 * @param {T} pane @param {number} fieldDeg @param {string} projection @returns {T} */
export function filled(pane, fieldDeg, projection) {
  const { tallestDeg } = PROJECTIONS[projection];
  if (!tallestDeg) return pane;
  const height = Math.min(pane.height, Math.floor((pane.width * tallestDeg) / fieldDeg));
  return { ...pane, height, y: pane.y + Math.floor((pane.height - height) / 2) };
}

/** View pixel of a ray in the view frame; null where the projection has none: behind a perspective
 * view. A crop's are those of a lens whose radius grows evenly with the angle.
 * @param {Viewport} view @param {Vector} ray @returns {Point | null} */
export function project(view, ray) {
  const place = placeOf(projectionOf(view), ray);
  const f = focalPx(view);
  return place && [(view.width - 1) / 2 + f * place[0], (view.height - 1) / 2 + f * place[1]];
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
  if (projectionOf(view) === 'crop') return windowOutline(view, cameraFromView, camera);
  const f = focalPx(view);
  const [right, bottom] = [view.width / 2 / f, view.height / 2 / f];
  const corners = [[-right, -bottom], [right, -bottom], [right, bottom], [-right, bottom]];
  const points = corners.flatMap(([x, y], side) => {
    const [nextX, nextY] = corners[(side + 1) % 4];
    return Array.from({ length: steps }, (_, i) => {
      const along = i / steps;
      const ray = rayOf(projectionOf(view), x + (nextX - x) * along, y + (nextY - y) * along);
      return camera.project(apply(cameraFromView, ray));
    });
  });
  return [...points, points[0]];
}

/** That of a crop, a window of the picture; nothing where its middle is beyond the lens.
 * @param {Viewport} view @param {number[]} cameraFromView
 * @param {import('./camera.js').Camera} camera @returns {(Point | null)[]} */
function windowOutline(view, cameraFromView, camera) {
  const middle = camera.project(apply(cameraFromView, [0, 0, 1]));
  if (!middle) return [];
  const perPx = camera.g[0] / 2 / focalPx(view);
  const [right, down] = [(view.width / 2) * perPx, (view.height / 2) * perPx];
  const [[a, b], [c, d]] = camera.stretch;
  const corners = [[-right, -down], [right, -down], [right, down], [-right, down], [-right, -down]];
  return corners.map(([x, y]) => [middle[0] + a * x + b * y, middle[1] + c * x + d * y]);
}
