// Lines and words over the picture, drawn with WebGL2 into the same canvas: they belong to the
// same frame as the picture, and cost no second full-screen layer.

import { buildProgram } from './shader.js';

/** @typedef {import('./camera.js').Point} Point */
/** @typedef {import('./renderer.js').Rect} Rect */
/** @typedef {[number, number, number, number]} Color red, green, blue, opacity; 0 to 1 */

/** @type {Record<string, Color>} */
export const COLORS = {
  line: [0.553, 1, 0.773, 1],
  bright: [0.918, 1, 0.961, 1],
  amber: [1, 0.82, 0.4, 1],
  rim: [0, 0.047, 0.039, 0.55],
  box: [0.016, 0.07, 0.063, 0.85],
};

const GLYPHS = ' 0123456789+−°ACDEGHILOPRST';
const FONT = 'ui-monospace, "SF Mono", "Cascadia Mono", "DejaVu Sans Mono", monospace';
const RIM_PX = 1.25;

const TO_CLIP = 'vec4(2.0 * p.x / canvas.x - 1.0, 1.0 - 2.0 * p.y / canvas.y, 0.0, 1.0)';

// Each instance is a straight piece; its corners lie a pixel outside for the soft edge.
const LINE_VERTEX = `#version 300 es
layout(location = 0) in vec4 ends;
uniform vec2 canvas;
uniform float half_width;
out float across;
void main() {
  vec2 along = ends.zw - ends.xy;
  vec2 normal = vec2(-along.y, along.x) / max(length(along), 1e-6);
  across = (half_width + 1.0) * float(2 * (gl_VertexID & 1) - 1);
  vec2 p = ends.xy + along * float(gl_VertexID >> 1) + normal * across;
  gl_Position = ${TO_CLIP};
}`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
in float across;
uniform float half_width;
uniform vec4 color;
out vec4 fragment;
void main() {
  fragment = vec4(color.rgb, color.a * clamp(half_width + 0.5 - abs(across), 0.0, 1.0));
}`;

// Each instance is one letter: x, y of its cell, number in the sheet.
const TEXT_VERTEX = `#version 300 es
layout(location = 0) in vec3 letter;
uniform vec2 canvas;
uniform vec2 cell;
out vec2 texel;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * cell;
  vec2 p = letter.xy + corner;
  texel = corner + vec2(letter.z * cell.x, 0.0);
  gl_Position = ${TO_CLIP};
}`;

const TEXT_FRAGMENT = `#version 300 es
precision highp float;
in vec2 texel;
uniform sampler2D sheet;
uniform float opacity;
out vec4 fragment;
void main() {
  fragment = texelFetch(sheet, ivec2(texel), 0) * vec4(1.0, 1.0, 1.0, opacity);
}`;

const SHEET_UNIT = 5;

export class Pen {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.line = buildProgram(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.letters = buildProgram(gl, TEXT_VERTEX, TEXT_FRAGMENT);
    this.pieces = instances(gl, 4);
    this.places = instances(gl, 3);
    /** @type {Map<string, Sheet>} */
    this.sheets = new Map();
    this.ratio = 1;
    this.opacity = 1;
    /** @type {Point} */
    this.origin = [0, 0];
  }

  /** Starts drawing on the canvas. @param {number} ratio canvas pixels per unit */
  begin(ratio) {
    const { gl } = this;
    if (ratio !== this.ratio) this.forget();
    this.ratio = ratio;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.SCISSOR_TEST);
  }

  end() {
    this.gl.disable(this.gl.BLEND);
    this.gl.disable(this.gl.SCISSOR_TEST);
  }

  forget() {
    for (const { texture } of this.sheets.values()) this.gl.deleteTexture(texture);
    this.sheets.clear();
  }

  /** Only inside `rect`, whose corner becomes the origin. @param {Rect} rect */
  inside({ x, y, width, height }) {
    const { gl, ratio } = this;
    this.origin = [x * ratio, y * ratio];
    const bottom = gl.drawingBufferHeight - (y + height) * ratio;
    gl.scissor(...box(x * ratio, bottom, width * ratio, height * ratio));
  }

  /** @param {(Point | null)[][]} lines broken at null @param {number} width
   * @param {Color} color with a dark rim, so that it shows on any picture */
  stroke(lines, width, color = COLORS.line) {
    const count = this.load(lines);
    this.drawPieces(count, width / 2 + RIM_PX, COLORS.rim);
    this.drawPieces(count, width / 2, color);
  }

  /** @param {Rect} rect */
  fill({ x, y, width, height }) {
    const middle = y + height / 2;
    this.drawPieces(this.load([[[x, middle], [x + width, middle]]]), height / 2, COLORS.box);
  }

  /** @param {(Point | null)[][]} lines @returns {number} of straight pieces */
  load(lines) {
    const { gl, ratio, origin: [x, y] } = this;
    const values = lines.flatMap((points) => points.slice(1).flatMap((to, i) => {
      const from = points[i];
      if (!from || !to) return [];
      return [x + from[0] * ratio, y + from[1] * ratio, x + to[0] * ratio, y + to[1] * ratio];
    }));
    gl.bindVertexArray(this.pieces.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.pieces.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STREAM_DRAW);
    return values.length / 4;
  }

  /** @param {number} count @param {number} halfWidth @param {Color} color */
  drawPieces(count, halfWidth, [red, green, blue, alpha]) {
    const { gl, line } = this;
    gl.useProgram(line.handle);
    gl.uniform2f(line.at('canvas'), gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.uniform1f(line.at('half_width'), halfWidth * this.ratio);
    gl.uniform4f(line.at('color'), red, green, blue, alpha * this.opacity);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
  }

  /** Words centred at (x, y). @param {string} text @param {number} x @param {number} y
   * @param {Color} color */
  text(text, x, y, size = 12, color = COLORS.line) {
    const { gl, letters, ratio, origin } = this;
    const sheet = this.sheet(size, color);
    const left = Math.round(origin[0] + x * ratio - (text.length * sheet.step) / 2 - sheet.margin);
    const top = Math.round(origin[1] + y * ratio - sheet.cell[1] / 2);
    const values = [...text].flatMap((glyph, i) =>
      [left + Math.round(i * sheet.step), top, Math.max(0, GLYPHS.indexOf(glyph))]);
    gl.bindVertexArray(this.places.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.places.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STREAM_DRAW);
    gl.useProgram(letters.handle);
    gl.activeTexture(gl.TEXTURE0 + SHEET_UNIT);
    gl.bindTexture(gl.TEXTURE_2D, sheet.texture);
    gl.uniform1i(letters.at('sheet'), SHEET_UNIT);
    gl.uniform1f(letters.at('opacity'), this.opacity);
    gl.uniform2f(letters.at('canvas'), gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.uniform2f(letters.at('cell'), ...sheet.cell);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, text.length);
  }

  /** @param {number} size @param {Color} color @returns {Sheet} */
  sheet(size, color) {
    const key = `${size} ${color}`;
    const sheet = this.sheets.get(key) ?? makeSheet(this.gl, size * this.ratio, color, this.ratio);
    this.sheets.set(key, sheet);
    return sheet;
  }
}

/** @typedef {{texture: WebGLTexture, cell: [number, number], step: number, margin: number}} Sheet
 * all letters in a row; cells overlap by their margins when written */

/** @param {WebGL2RenderingContext} gl @param {number} size @param {Color} color
 * @param {number} ratio @returns {Sheet} */
function makeSheet(gl, size, color, ratio) {
  const canvas = document.createElement('canvas');
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
  const font = `600 ${size}px ${FONT}`;
  context.font = font;
  const step = context.measureText('0').width;
  const margin = Math.ceil(2 * ratio);
  /** @type {[number, number]} */
  const cell = [Math.ceil(step) + 2 * margin, Math.ceil(1.3 * size) + 2 * margin];
  [canvas.width, canvas.height] = [cell[0] * GLYPHS.length, cell[1]];
  context.font = font; // a new size forgets it
  context.textBaseline = 'middle';
  context.lineWidth = 3 * ratio;
  context.lineJoin = 'round';
  [...GLYPHS].forEach((glyph, i) => {
    const at = /** @type {const} */ ([i * cell[0] + margin, cell[1] / 2]);
    context.strokeStyle = css(COLORS.rim);
    context.strokeText(glyph, ...at);
    context.fillStyle = css(color);
    context.fillText(glyph, ...at);
  });
  const texture = /** @type {WebGLTexture} */ (gl.createTexture());
  gl.activeTexture(gl.TEXTURE0 + SHEET_UNIT);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, canvas);
  return { texture, cell, step, margin };
}

/** One float attribute of `size` numbers for each instance.
 * @param {WebGL2RenderingContext} gl @param {number} size */
function instances(gl, size) {
  const array = gl.createVertexArray();
  const buffer = gl.createBuffer();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, size, gl.FLOAT, false, 0, 0);
  gl.vertexAttribDivisor(0, 1);
  return { array, buffer };
}

/** @param {Color} color */
const css = ([red, green, blue, alpha]) =>
  `rgba(${Math.round(red * 255)}, ${Math.round(green * 255)}, ${Math.round(blue * 255)}, ${alpha})`;

/** @param {number[]} numbers @returns {[number, number, number, number]} */
const box = (...numbers) => /** @type {any} */ (numbers.map((value) => Math.round(value)));
