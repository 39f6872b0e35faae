// Compiles view.glsl, once per kind of picture and output.

const VERTEX = `#version 300 es
void main() {  // one triangle over the whole viewport
  gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1);
}`;

const HEADER = `#version 300 es
precision highp float;
precision highp int;
`;

/** @typedef {{handle: WebGLProgram, at: (name: string) => WebGLUniformLocation | null}} Program */

export class Shaders {
  /** @param {WebGL2RenderingContext} gl @param {string} body the text of view.glsl */
  constructor(gl, body) {
    this.gl = gl;
    this.body = body;
    /** @type {Map<string, Program>} */
    this.programs = new Map();
  }

  /** The program with these #defines, in use. @param {string[]} defines @returns {Program} */
  use(defines) {
    const key = defines.join(' ');
    const program = this.programs.get(key) ?? this.build(defines);
    this.programs.set(key, program);
    this.gl.useProgram(program.handle);
    return program;
  }

  /** @param {string[]} defines @returns {Program} */
  build(defines) {
    const head = HEADER + defines.map((name) => `#define ${name}\n`).join('');
    return buildProgram(this.gl, VERTEX, head + this.body);
  }
}

/** Throws an Error with the compiler's words. @param {WebGL2RenderingContext} gl
 * @param {string} vertex @param {string} fragment @returns {Program} */
export function buildProgram(gl, vertex, fragment) {
  const handle = /** @type {WebGLProgram} */ (gl.createProgram());
  gl.attachShader(handle, compile(gl, gl.VERTEX_SHADER, vertex));
  gl.attachShader(handle, compile(gl, gl.FRAGMENT_SHADER, fragment));
  gl.linkProgram(handle);
  if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) {
    throw new Error(`shader: ${gl.getProgramInfoLog(handle)}`);
  }
  /** @type {Map<string, WebGLUniformLocation | null>} */
  const places = new Map();
  const at = (/** @type {string} */ name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(handle, name));
    return places.get(name) ?? null;
  };
  return { handle, at };
}

/** @param {WebGL2RenderingContext} gl @param {number} kind @param {string} text */
function compile(gl, kind, text) {
  const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
  gl.shaderSource(shader, text);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
    throw new Error(`shader: ${gl.getShaderInfoLog(shader)}`);
  }
  return shader;
}
