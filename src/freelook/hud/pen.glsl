// Draws the HUD's lines and letters; the page and the window compile this same text, with a header
// of their own and VERTEX or FRAGMENT, LINE or LETTER defined. Pixels, y down.

#ifdef VERTEX

uniform vec2 canvas;     // size of the viewport
uniform vec2 middle;     // of the view
uniform vec4 viewer;     // a viewer's lens: k1, k2, focal length (0: none), shift to the right

// Where a place of the view is shown, through the lens of a viewer: the reverse of view.glsl's.
vec2 shown(vec2 p) {
  vec2 away = p - middle;
  float r = length(away) / max(viewer.z, 1e-6);
  if (viewer.z > 0.0 && r > 1e-6) {
    float s = r;
    for (int i = 0; i < 6; i++) {  // Newton's method for s (1 + k1 s^2 + k2 s^4) = r
      float s2 = s * s;
      float slope = 1.0 + s2 * (3.0 * viewer.x + 5.0 * viewer.y * s2);
      s -= (s * (1.0 + s2 * (viewer.x + viewer.y * s2)) - r) / max(slope, 0.1);
    }
    away *= s / r;
  }
  return middle + away + vec2(viewer.w, 0.0);
}

vec4 to_clip(vec2 p) {
  return vec4(2.0 * p.x / canvas.x - 1.0, 1.0 - 2.0 * p.y / canvas.y, 0.0, 1.0);
}

out vec4 ink;

#ifdef LINE
layout(location = 0) in vec4 ends;
layout(location = 1) in float half_width;
layout(location = 2) in vec4 color;
out vec2 across;  // from the line's middle, and its half width

void main() {  // corners lie a pixel outside for the soft edge
  vec2 from = shown(ends.xy);
  vec2 to = shown(ends.zw);
  vec2 along = to - from;
  vec2 way = along / max(length(along), 1e-6);
  vec2 normal = vec2(-way.y, way.x);
  float joint = min(0.15 * half_width, 0.5);  // closes the gaps of a bent line
  across = vec2((half_width + 1.0) * float(2 * (gl_VertexID & 1) - 1), half_width);
  ink = color;
  float end = float(gl_VertexID >> 1);
  gl_Position = to_clip(mix(from, to, end) + way * joint * (2.0 * end - 1.0) + normal * across.x);
}
#endif

#ifdef LETTER
layout(location = 0) in vec4 cell;    // left, top on the canvas; width, height
layout(location = 1) in vec2 corner;  // left, top in the sheet
layout(location = 2) in vec4 color;
out vec2 texel;

void main() {
  vec2 inside = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * cell.zw;
  vec2 centre = cell.xy + cell.zw / 2.0;
  vec2 moved = floor(shown(centre) - centre + 0.5);  // whole pixels: letters stay crisp
  texel = corner + inside;
  ink = color;
  gl_Position = to_clip(cell.xy + moved + inside);
}
#endif

#endif

#ifdef FRAGMENT

in vec4 ink;
out vec4 fragment;

#ifdef LINE
in vec2 across;

void main() {
  fragment = vec4(ink.rgb, ink.a * clamp(across.y + 0.5 - abs(across.x), 0.0, 1.0));
}
#endif

#ifdef LETTER
in vec2 texel;
uniform sampler2D sheet;  // how much of a pixel the stroke covers, and the rim
uniform vec4 rim;
uniform bool under;       // first all rims, then the strokes: no rim lies on a neighbour's stroke

void main() {
  vec2 covered = texelFetch(sheet, ivec2(texel), 0).rg;
  fragment = under ? vec4(rim.rgb, rim.a * ink.a * covered.g) : vec4(ink.rgb, ink.a * covered.r);
}
#endif

#endif
