// The fisheye camera as the station describes it, for drawing outlines and for the shader's
// uniforms. The projection is the one of freelook/camera.py, with the same table.

/** @typedef {import('./quaternion.js').Vector} Vector */
/** @typedef {[number, number]} Point */
/**
 * @typedef {object} CameraJson
 * @property {Point} size @property {Point} center @property {[Point, Point]} stretch
 * @property {number} t_max @property {number[]} g
 * @property {{p_max: number, size: number, values: number[]} | null} offsets
 * @property {[Vector, Vector, Vector]} camera_from_head
 */

export class Camera {
  /** @param {CameraJson} json */
  constructor(json) {
    this.size = json.size;
    this.center = json.center;
    this.stretch = json.stretch;
    this.tMax = json.t_max;
    this.g = Float32Array.from(json.g);
    /** only of a lens that is not round: pixels to add, as x, y pairs on a square grid over p */
    this.offsets = json.offsets && {
      pMax: json.offsets.p_max, size: json.offsets.size,
      values: Float32Array.from(json.offsets.values),
    };
    /** rows of the 3 x 3 matrix, one after the other */
    this.cameraFromHead = json.camera_from_head.flat();
  }

  /** The same camera delivering its whole picture at another size.
   * @param {number} width @param {number} height */
  resized(width, height) {
    const scale = [width / this.size[0], height / this.size[1]];
    const same = Object.create(Camera.prototype);
    return /** @type {Camera} */ (Object.assign(same, this, {
      size: [width, height],
      center: this.center.map((value, i) => (value + 0.5) * scale[i] - 0.5),
      stretch: this.stretch.map((row, i) => row.map((value) => value * scale[i])),
    }));
  }

  /** Whether a picture of this size can be this camera's whole picture.
   * @param {number} width @param {number} height */
  sameShape(width, height) {
    return Math.abs((width * this.size[1]) / (height * this.size[0]) - 1) < 0.01;
  }

  /** Pixel of a ray in the camera frame, or null where the lens does not see it.
   * @param {Vector} ray @returns {Point | null} */
  project([x, y, z]) {
    const depth = Math.hypot(x, y, z) + z;
    const [px, py] = [x / depth, y / depth];
    const t = px * px + py * py;
    if (!(t <= this.tMax)) return null;
    const place = (Math.sqrt(t) + t) / (Math.sqrt(this.tMax) + this.tMax) * (this.g.length - 1);
    const low = Math.min(Math.floor(place), this.g.length - 2);
    const g = this.g[low] + (this.g[low + 1] - this.g[low]) * (place - low);
    const [ex, ey] = this.offsetAt(px, py);
    const [u, v] = [g * px + ex, g * py + ey];
    const [[a, b], [c, d]] = this.stretch;
    return [this.center[0] + a * u + b * v, this.center[1] + c * u + d * v];
  }

  /** @param {number} px @param {number} py @returns {Point} */
  offsetAt(px, py) {
    if (!this.offsets) return [0, 0];
    const { pMax, size, values } = this.offsets;
    const [x, y] = [px, py].map((p) => (
      Math.min(Math.max((p / pMax + 1) / 2 * (size - 1), 0), size - 1)));
    const [i, j] = [x, y].map((place) => Math.min(Math.floor(place), size - 2));
    const [fx, fy] = [x - i, y - j];
    const at = (/** @type {number} */ k) => {
      const corner = (/** @type {number} */ dj, /** @type {number} */ di) => (
        values[2 * ((j + dj) * size + i + di) + k]);
      const top = corner(0, 0) * (1 - fx) + corner(0, 1) * fx;
      const below = corner(1, 0) * (1 - fx) + corner(1, 1) * fx;
      return top * (1 - fy) + below * fy;
    };
    return [at(0), at(1)];
  }
}
