// The fisheye camera as the station describes it, for drawing outlines and for the shader's
// uniforms. The projection is the one of freelook/camera.py, with the same table.

/** @typedef {import('./quaternion.js').Vector} Vector */
/** @typedef {[number, number]} Point */
/**
 * @typedef {object} CameraJson
 * @property {Point} size @property {Point} center @property {[Point, Point]} stretch
 * @property {number} t_max @property {number[]} g
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
    const [[a, b], [c, d]] = this.stretch;
    return [
      this.center[0] + g * (a * px + b * py),
      this.center[1] + g * (c * px + d * py),
    ];
  }
}
