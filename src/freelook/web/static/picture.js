// The newest picture as textures: as the decoder's planes, exact and cheap where software draws,
// or as RGB that the browser converts, cheap where a GPU does.

import { rgbFromYuv } from './colour.js';

/** @typedef {import('./colour.js').ColorSpace} ColorSpace */
/** @typedef {{width: number, height: number, channels: 1 | 2, stride: number, bytes: Uint8Array}} Plane
 * stride in bytes */

/** Texture units behind those of the planes or RGB: the lens's table and grid, what is drawn into. */
export const LENS_UNIT = 3;
export const OFFSETS_UNIT = 4;
export const TARGET_UNIT = 5;

export class Picture {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.textures = [0, 1, 2].map((unit) => makeTexture(gl, unit));
    /** @type {string[]} */
    this.formats = ['', '', ''];
    /** grows with each upload; 0: no picture yet */
    this.version = 0;
    this.width = 0;
    this.height = 0;
    /** @type {'RGB' | 'PLANES' | 'NV12'} */
    this.layout = 'RGB';
    /** @type {ColorSpace} */
    this.color = { matrix: 'bt709', fullRange: false };
  }

  /** Two planes are Y and UV, three are Y, U, V.
   * @param {Plane[]} planes @param {ColorSpace} color */
  uploadPlanes(planes, color) {
    planes.forEach((plane, unit) => this.uploadPlane(unit, plane));
    this.layout = planes.length === 2 ? 'NV12' : 'PLANES';
    this.color = color;
    this.changed(planes[0].width, planes[0].height);
  }

  /** @param {number} unit @param {Plane} plane */
  uploadPlane(unit, { width, height, channels, stride, bytes }) {
    const { gl } = this;
    const [store, format] = channels === 1 ? [gl.R8, gl.RED] : [gl.RG8, gl.RG];
    this.prepare(unit, store, width, height);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, stride / channels);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, format, gl.UNSIGNED_BYTE, bytes);
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, 0);
  }

  /** Binds the unit's texture, made anew when its kind or size changes.
   * @param {number} unit @param {number} store @param {number} width @param {number} height */
  prepare(unit, store, width, height) {
    const { gl } = this;
    const format = `${store} ${width} ${height}`;
    if (this.formats[unit] !== format) {
      gl.deleteTexture(this.textures[unit]);
      this.textures[unit] = makeTexture(gl, unit);
      gl.texStorage2D(gl.TEXTURE_2D, 1, store, width, height);
      this.formats[unit] = format;
    }
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, this.textures[unit]);
  }

  /** @param {HTMLVideoElement | VideoFrame} frame @param {number} width @param {number} height */
  uploadFrame(frame, width, height) {
    const { gl } = this;
    this.prepare(0, gl.RGBA8, width, height);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, frame);
    this.layout = 'RGB';
    this.changed(width, height);
  }

  /** @param {number} width @param {number} height */
  changed(width, height) {
    this.width = width;
    this.height = height;
    this.version += 1;
  }

  /** The #defines a program needs for this picture. */
  get defines() {
    return this.layout === 'RGB' ? [] : [this.layout];
  }

  /** @param {import('./shader.js').Program} program */
  bind(program) {
    const { gl } = this;
    ['luma', 'chroma_u', 'chroma_v'].forEach((name, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, this.textures[unit]);
      gl.uniform1i(program.at(name), unit);
    });
    const { matrix, offset } = rgbFromYuv(this.color);
    gl.uniformMatrix3fv(program.at('rgb_from_yuv'), true, matrix);
    gl.uniform3fv(program.at('yuv_offset'), offset);
  }
}

/** @param {WebGL2RenderingContext} gl @param {number} unit @param {number} filter */
export function makeTexture(gl, unit, filter = gl.LINEAR) {
  const texture = /** @type {WebGLTexture} */ (gl.createTexture());
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  return texture;
}
