// Draws views and whole fisheye pictures with WebGL2, on the canvas or into memory.

import { LENS_UNIT, OFFSETS_UNIT, Picture, TARGET_UNIT, makeTexture } from './picture.js';
import { Pen } from './pen.js';
import { matrix, matrixProduct } from './quaternion.js';
import { Shaders } from './shader.js';
import { PROJECTIONS } from './projections.js';
import { focalPx, projectionOf } from './viewport.js';

/** @typedef {import('./quaternion.js').Quaternion} Quaternion */
/** @typedef {import('./viewport.js').Viewport} Viewport */
/** @typedef {{x: number, y: number, width: number, height: number}} Rect canvas pixels, y down */

export class Renderer {
  /** Throws an Error with a sentence for the user where WebGL2 is missing.
   * @param {HTMLCanvasElement} canvas @param {string} shaderBody
   * @param {import('./camera.js').Camera} profile
   * @param {import('./station.js').Hud} [hud] what is drawn over views, if anything is */
  constructor(canvas, shaderBody, profile, hud) {
    const gl = canvas.getContext('webgl2', {
      alpha: false, antialias: false, depth: false,
      powerPreference: 'high-performance',
    });
    if (!gl) throw new Error('This browser has no WebGL2, which draws the view.');
    this.gl = gl;
    this.canvas = canvas;
    this.profile = profile;
    this.camera = profile;
    this.grey = 0;
    this.picture = new Picture(gl);
    this.shaders = new Shaders(gl, shaderBody);
    this.lens = makeTexture(gl, LENS_UNIT, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, profile.g.length, 1, 0, gl.RED, gl.FLOAT, profile.g);
    this.offsets = profile.offsets && makeTexture(gl, OFFSETS_UNIT, gl.NEAREST);
    if (profile.offsets) {
      const { size, values } = profile.offsets;
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RG32F, size, size, 0, gl.RG, gl.FLOAT, values);
    }
    this.pen = hud && new Pen(gl, hud);
    this.noAttributes = gl.createVertexArray();
  }

  /** The GPU's name, or the software that stands in for one. */
  get name() {
    const { gl } = this;
    const known = gl.getExtension('WEBGL_debug_renderer_info');
    return String(gl.getParameter(known ? known.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  }

  get software() {
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(this.name);
  }

  clear() {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
  }

  /** @param {Rect} rect @param {Quaternion} headFromView @param {number} hfovDeg
   * @param {string} [projection] */
  drawView(rect, headFromView, hfovDeg, projection) {
    if (!this.picture.version) return;
    const view = { width: rect.width, height: rect.height, hfovDeg, projection };
    const program = this.begin(definesOf(view));
    this.placeOnCanvas(program, rect);
    this.setView(program, view, headFromView);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3);
  }

  /** The whole picture, as large as it fits into `rect`; returns where it lies, canvas pixels.
   * @param {Rect} rect @returns {Rect} */
  drawFisheye(rect) {
    const { width, height } = this.picture.version ? this.picture : sizeOf(this.profile.size);
    const scale = Math.min(rect.width / width, rect.height / height);
    const place = {
      x: Math.round(rect.x + (rect.width - width * scale) / 2),
      y: Math.round(rect.y + (rect.height - height * scale) / 2),
      width: Math.max(1, Math.round(width * scale)),
      height: Math.max(1, Math.round(height * scale)),
    };
    if (!this.picture.version) return place;
    const program = this.begin(['FISHEYE']);
    this.placeOnCanvas(program, place);
    const [sx, sy] = [width / place.width, height / place.height];
    this.gl.uniform4f(program.at('picture_from_pixel'), sx, sy, sx / 2 - 0.5, sy / 2 - 0.5);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3);
    return place;
  }

  /** The view as RGBA bytes, rows from the top.
   * @param {Viewport} view @param {Quaternion} headFromView @returns {Uint8Array} */
  readView(view, headFromView) {
    const { gl } = this;
    const pixels = new Uint8Array(view.width * view.height * 4);
    this.drawInto(gl.RGBA8, view, headFromView, []);
    gl.readPixels(0, 0, view.width, view.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return this.released(pixels);
  }

  /** For each view pixel: x and y in the picture, t, alpha; rows from the top.
   * @param {Viewport} view @param {Quaternion} headFromView @returns {Float32Array} */
  readCoordinates(view, headFromView) {
    const { gl } = this;
    if (!gl.getExtension('EXT_color_buffer_float')) throw new Error('no float framebuffers here');
    const values = new Float32Array(view.width * view.height * 4);
    this.drawInto(gl.RGBA32F, view, headFromView, ['COORDINATES']);
    gl.readPixels(0, 0, view.width, view.height, gl.RGBA, gl.FLOAT, values);
    return this.released(values);
  }

  /** @param {number} store @param {Viewport} view @param {Quaternion} headFromView
   * @param {string[]} defines */
  drawInto(store, view, headFromView, defines) {
    const { gl } = this;
    this.target = { frame: gl.createFramebuffer(), texture: makeTexture(gl, TARGET_UNIT, gl.NEAREST) };
    gl.texStorage2D(gl.TEXTURE_2D, 1, store, view.width, view.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.frame);
    const { texture } = this.target;
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    const program = this.begin([...definesOf(view), ...defines]);
    gl.viewport(0, 0, view.width, view.height);
    gl.uniform4f(program.at('pixel_from_fragment'), 1, 1, -0.5, -0.5);
    this.setView(program, view, headFromView);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Frees what `drawInto` made. @template T @param {T} result @returns {T} */
  released(result) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(this.target?.frame ?? null);
    gl.deleteTexture(this.target?.texture ?? null);
    return result;
  }

  /** @param {string[]} defines */
  begin(defines) {
    const bent = this.offsets ? ['BENT'] : [];
    const program = this.shaders.use([...this.picture.defines, ...bent, ...defines]);
    this.gl.bindVertexArray(this.noAttributes);
    this.picture.bind(program);
    this.gl.uniform1f(program.at('grey'), this.grey);
    const { width, height } = this.picture;
    const fits = width === this.camera.size[0] && height === this.camera.size[1];
    if (!fits && this.picture.version) this.camera = this.profile.resized(width, height);
    return program;
  }

  /** @param {import('./shader.js').Program} program @param {Rect} rect */
  placeOnCanvas(program, { x, y, width, height }) {
    const { gl, canvas } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(x, canvas.height - y - height, width, height);
    gl.uniform4f(program.at('pixel_from_fragment'), 1, -1, -x - 0.5, canvas.height - y - 0.5);
  }

  /** @param {import('./shader.js').Program} program @param {Viewport} view
   * @param {Quaternion} headFromView */
  setView(program, view, headFromView) {
    const { gl, camera } = this;
    const cameraFromView = matrixProduct(camera.cameraFromHead, matrix(headFromView));
    gl.uniform2f(program.at('view_center'), (view.width - 1) / 2, (view.height - 1) / 2);
    gl.uniform1f(program.at('view_focal_px'), focalPx(view));
    gl.uniformMatrix3fv(program.at('camera_from_view'), true, cameraFromView);
    gl.activeTexture(gl.TEXTURE0 + LENS_UNIT);
    gl.bindTexture(gl.TEXTURE_2D, this.lens);
    gl.uniform1i(program.at('lens_g'), LENS_UNIT);
    gl.uniform1f(program.at('lens_t_max'), camera.tMax);
    gl.uniform2fv(program.at('lens_center'), camera.center);
    gl.uniformMatrix2fv(program.at('lens_stretch'), true, camera.stretch.flat());
    if (!camera.offsets) return;
    gl.activeTexture(gl.TEXTURE0 + OFFSETS_UNIT);
    gl.bindTexture(gl.TEXTURE_2D, this.offsets);
    gl.uniform1i(program.at('lens_offsets'), OFFSETS_UNIT);
    gl.uniform1f(program.at('lens_p_max'), camera.offsets.pMax);
  }
}

/** @param {Viewport} view */
function definesOf(view) {
  const { define } = PROJECTIONS[projectionOf(view)];
  return define ? [define] : [];
}

/** @param {[number, number]} size */
const sizeOf = ([width, height]) => ({ width, height });
