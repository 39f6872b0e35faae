// Draws the HUD's shapes with WebGL2 into the same canvas: they belong to the same frame as the
// picture, and cost no second full-screen layer. freelook/hud/ink.py and renderers/gl_pen.py do the
// same, with the same shader.

import { makeSheet } from './letters.js';
import { scaled } from './layout.js';
import { buildProgram } from './shader.js';

/** @typedef {import('./renderer.js').Rect} Rect */
/** @typedef {import('./hud.js').Shape} Shape */
/** @typedef {import('./letters.js').Sheet} Sheet */
/** @typedef {[number, number, number, number]} Color red, green, blue, opacity; 0 to 1 */

const HEADER = `#version 300 es
precision highp float;
precision highp int;
`;
const SHEET_UNIT = 6;
const SHARES = { left: 0, middle: 0.5, right: 1 };

export class Pen {
  /** @param {WebGL2RenderingContext} gl
   * @param {{source: string, known: import('./hud_words.js').Definition}} hud */
  constructor(gl, { source, known }) {
    this.gl = gl;
    this.known = known;
    const program = (/** @type {string} */ kind) => buildProgram(gl,
      `${HEADER}#define ${kind}\n#define VERTEX\n${source}`,
      `${HEADER}#define ${kind}\n#define FRAGMENT\n${source}`);
    this.line = { program: program('LINE'), ...instances(gl, [4, 1, 4]) };
    this.letter = { program: program('LETTER'), ...instances(gl, [4, 2, 4]) };
    /** @type {Map<number, Sheet>} by size in pixels */
    this.sheets = new Map();
    /** @type {WebGLTexture | null} all sheets, one below the other */
    this.texture = null;
    this.ratio = 1;
    this.theme = known.themes[Object.keys(known.themes)[0]];
  }

  /** Starts drawing on the canvas. @param {number} ratio canvas pixels per point
   * @param {string} theme */
  begin(ratio, theme) {
    const { gl, known } = this;
    // a page that remembers a theme there is no more goes on with another
    const wanted = Object.hasOwn(known.themes, theme) ? known.themes[theme] : this.theme;
    if (ratio !== this.ratio || wanted !== this.theme) this.forget();
    [this.ratio, this.theme] = [ratio, wanted];
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  end() {
    this.gl.disable(this.gl.BLEND);
  }

  forget() {
    this.gl.deleteTexture(this.texture);
    this.texture = null;
    this.sheets.clear();
  }

  /** @param {Shape[]} shapes in points from the corner of `rect` @param {Rect} rect */
  draw(shapes, rect) {
    const { gl, line, letter } = this;
    const { x, y, width, height } = scaled(rect, this.ratio);
    gl.viewport(x, gl.drawingBufferHeight - y - height, width, height);
    const pieces = shapes.flatMap((shape) => this.piecesOf(shape));
    this.render(line, pieces, 9, [width, height], () => {});
    const letters = shapes.flatMap((shape) => this.lettersOf(shape));
    if (!letters.length) return;
    this.useSheets();
    // first all rims, then the strokes: no rim lies on a neighbour's stroke
    for (const under of [1, 0]) {
      this.render(letter, letters, 10, [width, height], ({ at }) => {
        gl.uniform1i(at('sheet'), SHEET_UNIT);
        gl.uniform4fv(at('rim'), this.theme.rim);
        gl.uniform1i(at('under'), under);
      });
    }
  }

  /** @param {{program: import('./shader.js').Program, array: any, buffer: any}} what
   * @param {number[]} values @param {number} count of one instance @param {number[]} size
   * @param {(program: import('./shader.js').Program) => void} set more uniforms */
  render({ program, array, buffer }, values, count, size, set) {
    const { gl } = this;
    gl.useProgram(program.handle);
    gl.uniform2f(program.at('canvas'), size[0], size[1]);
    gl.uniform2f(program.at('middle'), size[0] / 2, size[1] / 2);
    gl.uniform4f(program.at('viewer'), 0, 0, 0, 0);
    set(program);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STREAM_DRAW);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, values.length / count);
  }

  /** x0, y0, x1, y1, half width, colour, of each straight piece. @param {Shape} shape
   * @returns {number[]} */
  piecesOf(shape) {
    const { ratio, theme } = this;
    if (shape.kind === 'text') return [];
    const color = this.color(shape.role, shape.opacity);
    if (shape.kind === 'box') {
      const { x, y, width, height } = shape.rect;
      const middle = (y + height / 2) * ratio;
      return [x * ratio, middle, (x + width) * ratio, middle, (height / 2) * ratio, ...color];
    }
    const half = (shape.width * theme.weight * ratio) / 2;
    const [red, green, blue, alpha] = theme.rim;
    const rim = [half + theme.rim_width * ratio, red, green, blue, alpha * shape.opacity];
    return [rim, [half, ...color]].flatMap((rest) => shape.pieces.flatMap(([x0, y0, x1, y1]) =>
      [x0 * ratio, y0 * ratio, x1 * ratio, y1 * ratio, ...rest]));
  }

  /** Left, top, width, height, place in the sheets, colour, of each letter, on whole pixels: they
   * stay crisp. @param {Shape} shape @returns {number[]} */
  lettersOf(shape) {
    if (shape.kind !== 'text') return [];
    const { ratio } = this;
    const sheet = this.sheet(shape.size * ratio);
    const color = this.color(shape.role, shape.opacity);
    const letters = [...shape.text];
    const share = SHARES[/** @type {keyof typeof SHARES} */ (shape.anchor)];
    const start = shape.x * ratio - share * letters.length * sheet.step;
    const left = Math.floor(start - (sheet.cell[0] - sheet.step) / 2 + 0.5);
    const top = Math.floor(shape.y * ratio - sheet.cell[1] / 2 + 0.5);
    return letters.flatMap((letter, i) => (letter === ' ' ? [] : [
      left + Math.floor(i * sheet.step + 0.5), top, ...sheet.cell,
      sheet.cell[0] * (sheet.numbers.get(letter) ?? 0), sheet.row, ...color,
    ]));
  }

  /** @param {string} role @param {number} opacity @returns {Color} */
  color(role, opacity) {
    const [red, green, blue, alpha = 1] = this.theme[role];
    return [red, green, blue, alpha * opacity];
  }

  /** @param {number} sizePx @returns {Sheet} */
  sheet(sizePx) {
    const made = this.sheets.get(sizePx);
    if (made) return made;
    const sheet = makeSheet(this.known, sizePx, this.theme.rim_width * this.ratio, this.theme.weight);
    sheet.row = [...this.sheets.values()].reduce((sum, { height }) => sum + height, 0);
    this.sheets.set(sizePx, sheet);
    this.gl.deleteTexture(this.texture);
    this.texture = null;
    return sheet;
  }

  useSheets() {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + SHEET_UNIT);
    if (this.texture) return gl.bindTexture(gl.TEXTURE_2D, this.texture);
    const sheets = [...this.sheets.values()];
    const width = Math.max(...sheets.map((sheet) => sheet.width));
    const height = sheets.reduce((sum, sheet) => sum + sheet.height, 0);
    this.texture = /** @type {WebGLTexture} */ (gl.createTexture());
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RG8, width, height);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    for (const sheet of sheets) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, sheet.row, sheet.width, sheet.height, gl.RG,
        gl.UNSIGNED_BYTE, sheet.covered);
    }
    return undefined;
  }
}

/** Float attributes of each instance, so many numbers each.
 * @param {WebGL2RenderingContext} gl @param {number[]} counts */
function instances(gl, counts) {
  const array = gl.createVertexArray();
  const buffer = gl.createBuffer();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  const whole = counts.reduce((sum, count) => sum + count, 0);
  let before = 0;
  counts.forEach((count, i) => {
    gl.enableVertexAttribArray(i);
    gl.vertexAttribPointer(i, count, gl.FLOAT, false, 4 * whole, 4 * before);
    gl.vertexAttribDivisor(i, 1);
    before += count;
  });
  return { array, buffer };
}
