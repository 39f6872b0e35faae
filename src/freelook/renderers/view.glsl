// What a virtual camera sees in a fisheye picture. One fragment shader body for WebGL2 and
// desktop GL: the program puts "#version 300 es" with "precision highp float;" or
// "#version 330 core" in front, and these lines as wanted:
//
//   #define PLANES        Y, U, V in three one-channel textures (gray: 1 x 1 textures of 128)
//   #define NV12          Y in a one-channel, UV in a two-channel texture
//                         (neither: one RGB texture)
//   #define FISHEYE       the whole fisheye picture as it is, instead of the view
//   #define BENT          the lens is not round: lens_offsets is used
//   #define COORDINATES   instead of colour: picture x and y in pixels, t, alpha
//   #define PLANE         instead of colour: the plane in `luma` as it is
//   #define ANTIALIAS     more samples where the view shrinks the picture
//   #define BICUBIC       sharper than bilinear where it enlarges
//   #define VIEWER        makes up for the lens of a viewer in front of the screen
//   #define PANNINI       or STEREOGRAPHIC, CYLINDRICAL, EQUIRECTANGULAR: the view's projection
//                         (none: perspective)
//   #define CUT           a window of the picture as it is, instead of a projection
//
// Pixels: (0, 0) is the middle of the top-left one. The projection is defined in camera.py.

uniform vec4 pixel_from_fragment;  // scale x, y and offset x, y: from gl_FragCoord to view pixels
uniform float grey;                // 0 live, 1 fully greyed: the video is lost

#ifdef FISHEYE
uniform vec4 picture_from_pixel;   // scale x, y and offset x, y: from view to picture pixels
#else
uniform vec2 view_center;
uniform float view_focal_px;
uniform mat3 camera_from_view;
uniform highp sampler2D lens_g;    // 256 x 1, float: g at equal steps of sqrt(t) + t up to lens_t_max
uniform float lens_t_max;
uniform vec2 lens_center;
uniform mat2 lens_stretch;
#ifdef BENT
uniform highp sampler2D lens_offsets;  // n x n, two floats: pixels to add before the stretch
uniform float lens_p_max;              // it covers p from -lens_p_max to lens_p_max
#endif
#endif

#if defined(PLANES) || defined(NV12)
uniform sampler2D luma;
uniform sampler2D chroma_u;        // NV12: U and V together
#ifdef PLANES
uniform sampler2D chroma_v;
#endif
uniform mat3 rgb_from_yuv;
uniform vec3 yuv_offset;
#else
uniform sampler2D luma;            // red, green, blue
#endif
#ifdef PLANE
uniform float plane_scale;         // how many times smaller than the picture
uniform vec4 plane_black;
#endif
#ifdef VIEWER
uniform vec2 viewer_k;             // of r^2 and r^4, r in focal lengths of the view
#endif

out vec4 fragment;

// How much of a bilinear sample at `pixel` lies inside the picture; outside is black.
float inside(vec2 pixel) {
    vec2 size = vec2(textureSize(luma, 0));
    vec2 cover = clamp(pixel + 1.0, 0.0, 1.0) * clamp(size - pixel, 0.0, 1.0);
    return cover.x * cover.y;
}

// From pixels of the picture to those of a plane `scale` times smaller: a chroma sample sits in
// the middle of its 2 x 2 luma pixels, also at an odd border.
vec2 in_plane(vec2 pixel, float scale) {
    return (pixel + 0.5) / scale - 0.5;
}

#ifdef BICUBIC
// Weights of four neighbours: Keys' cubic with a = -0.75, as OpenCV's.
vec4 cubic(float part) {
    vec4 far = abs(vec4(part + 1.0, part, 1.0 - part, 2.0 - part));
    vec2 outer = ((-0.75 * far.xw + 3.75) * far.xw - 6.0) * far.xw + 3.0;
    vec2 inner = (1.25 * far.yz - 2.25) * far.yz * far.yz + 1.0;
    return vec4(outer.x, inner, outer.y);
}

vec4 sharp(sampler2D plane, vec2 pixel) {
    vec2 low = floor(pixel);
    vec4 across = cubic(pixel.x - low.x), down = cubic(pixel.y - low.y);
    ivec2 first = ivec2(low) - 1, last = textureSize(plane, 0) - 1;
    vec4 sum = vec4(0.0);
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++)
            sum += across[i] * down[j]
                 * texelFetch(plane, clamp(first + ivec2(i, j), ivec2(0), last), 0);
    return clamp(sum, 0.0, 1.0);
}
#endif

#ifdef ANTIALIAS
// How much of a view pixel's spread a bilinear sample, itself a pixel wide, does not yet cover.
vec2 uncovered(vec2 right, vec2 down) {
    return sqrt(max(vec2(dot(right, right), dot(down, down)) - 1.0, 0.0));
}

// The mean over a view pixel: up to 8 x 4 samples, from a smaller level of the texture (if it has
// any) where those would lie more than a pixel apart.
vec4 spread(sampler2D plane, vec2 pixel, vec2 right, vec2 down) {
    vec2 reach = uncovered(right, down);
    float most = max(reach.x, reach.y), least = min(reach.x, reach.y);
    float level = log2(max(1.0, max(most / 8.0, least / 4.0)));
    ivec2 taps = ivec2(clamp(ceil(reach / exp2(level)), vec2(2.0), vec2(8.0)));
    taps -= ivec2(equal(reach, vec2(0.0)));
    right *= reach.x / max(length(right), 1e-6);
    down *= reach.y / max(length(down), 1e-6);
    vec2 size = vec2(textureSize(plane, 0));
    vec4 sum = vec4(0.0);
    for (int j = 0; j < taps.y; j++)
        for (int i = 0; i < taps.x; i++) {
            vec2 place = (vec2(i, j) + 0.5) / vec2(taps) - 0.5;
            vec2 at = pixel + right * place.x + down * place.y + 0.5;
            sum += textureLod(plane, at / size, level);
        }
    return sum / float(taps.x * taps.y);
}
#endif

// A plane at one of its pixels, which moves by `right` and `down` from one view pixel to the next.
vec4 taken(sampler2D plane, vec2 pixel, vec2 right, vec2 down) {
#ifdef ANTIALIAS
    vec2 reach = uncovered(right, down);
    float shrinks = clamp(max(reach.x, reach.y), 0.0, 1.0);
#ifdef BICUBIC
    if (shrinks == 0.0) return sharp(plane, pixel);
    vec4 wide = spread(plane, pixel, right, down);
    return shrinks < 1.0 ? mix(sharp(plane, pixel), wide, shrinks) : wide;
#else
    if (shrinks > 0.0) return spread(plane, pixel, right, down);
#endif
#endif
#ifdef BICUBIC
    return sharp(plane, pixel);
#else
    return textureLod(plane, (pixel + 0.5) / vec2(textureSize(plane, 0)), 0.0);
#endif
}

vec3 picture(vec2 pixel, vec2 right, vec2 down) {
#if defined(PLANES) || defined(NV12)
    vec2 there = in_plane(pixel, 2.0), next = 0.5 * right, below = 0.5 * down;
#ifdef NV12
    vec2 uv = taken(chroma_u, there, next, below).rg;
#else
    vec2 uv = vec2(taken(chroma_u, there, next, below).r, taken(chroma_v, there, next, below).r);
#endif
    float y = taken(luma, pixel, right, down).r;
    return clamp(rgb_from_yuv * (vec3(y, uv) - yuv_offset), 0.0, 1.0);
#else
    return taken(luma, pixel, right, down).rgb;
#endif
}

vec4 shown(vec3 rgb) {
    float bright = dot(rgb, vec3(0.2126, 0.7152, 0.0722));
    return vec4(mix(rgb, vec3(0.55 * bright), grey), 1.0);
}

#ifdef FISHEYE

// Four samples a pixel: shrinks to a quarter without glitter.
void main() {
    vec2 here = pixel_from_fragment.xy * gl_FragCoord.xy + pixel_from_fragment.zw;
    vec2 pixel = picture_from_pixel.xy * here + picture_from_pixel.zw;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 4; i++) {
        vec2 tap = pixel + picture_from_pixel.xy * (vec2(i & 1, i >> 1) - 0.5) * 0.5;
        sum += picture(tap, vec2(0.0), vec2(0.0)) * inside(tap);
    }
    fragment = shown(sum / 4.0);
}

#else

float g_at(float t) {
    int last = textureSize(lens_g, 0).x - 1;
    float seen = min(t, lens_t_max);
    float place = (sqrt(seen) + seen) / (sqrt(lens_t_max) + lens_t_max) * float(last);
    int low = min(int(place), last - 1);
    float g_low = texelFetch(lens_g, ivec2(low, 0), 0).r;
    float g_high = texelFetch(lens_g, ivec2(low + 1, 0), 0).r;
    return mix(g_low, g_high, place - float(low));
}

vec2 offset_at(vec2 p) {
#ifdef BENT
    int last = textureSize(lens_offsets, 0).x - 1;
    vec2 place = clamp((p / lens_p_max + 1.0) * (0.5 * float(last)), 0.0, float(last));
    ivec2 low = min(ivec2(place), last - 1);
    vec2 part = place - vec2(low);
    vec2 top = mix(texelFetch(lens_offsets, low, 0).rg,
                   texelFetch(lens_offsets, low + ivec2(1, 0), 0).rg, part.x);
    vec2 below = mix(texelFetch(lens_offsets, low + ivec2(0, 1), 0).rg,
                     texelFetch(lens_offsets, low + ivec2(1, 1), 0).rg, part.x);
    return mix(top, below, part.y);
#else
    return vec2(0.0);
#endif
}

// The ray through a place of the view, counted from its middle in focal lengths. The definition
// is in projections.py.
vec3 view_ray(vec2 place) {
    float x = place.x, y = place.y;
#if defined(PANNINI)
    return vec3(x, y, 1.0 - x * x / 4.0);
#elif defined(STEREOGRAPHIC)
    return vec3(x, y, 1.0 - (x * x + y * y) / 4.0);
#elif defined(CYLINDRICAL)
    return vec3(sin(x), y, cos(x));
#elif defined(EQUIRECTANGULAR)
    return vec3(sin(x) * cos(y), sin(y), cos(x) * cos(y));
#else
    return vec3(x, y, 1.0);
#endif
}

// A ray in the camera frame by its stereographic coordinate, and t.
vec2 stereographic(vec3 ray, out float t) {
    float size = length(ray);
    float depth = max(size + ray.z, 1e-5 * size);  // 0 straight behind, where no lens sees
    vec2 p = ray.xy / depth;
    t = ray.z > 0.0 ? dot(p, p) : (size - ray.z) / depth;  // the same; each where exact
    return p;
}

#ifdef CUT
// The place in the round image, and in place of t what is as large on the rim.
vec2 round_image(vec2 place, out float t) {
    vec2 ahead = stereographic(camera_from_view[2], t);
    if (t > lens_t_max) ahead = length(ahead) > 1e-6 ? normalize(ahead) : vec2(1.0, 0.0);
    if (t > lens_t_max) ahead *= sqrt(lens_t_max);
    vec2 middle = ahead * g_at(dot(ahead, ahead)) + offset_at(ahead);
    vec2 point = middle + 0.5 * g_at(0.0) * place;
    t = dot(point, point) / (g_at(lens_t_max) * g_at(lens_t_max));
    return point;
}
#else
vec2 round_image(vec2 place, out float t) {
    vec2 p = stereographic(camera_from_view * view_ray(place), t);
    return p * g_at(t) + offset_at(p);
}
#endif

// Where the view is shown at `here`, so that a viewer's lens brings it back to its place.
vec2 through_viewer(vec2 here) {
#ifdef VIEWER
    vec2 off = (here - view_center) / view_focal_px;
    float r2 = dot(off, off);
    return view_center + (here - view_center) * (1.0 + r2 * (viewer_k.x + r2 * viewer_k.y));
#else
    return here;
#endif
}

void main() {
    vec2 here = pixel_from_fragment.xy * gl_FragCoord.xy + pixel_from_fragment.zw;
    here = through_viewer(here);
    float t;
    vec2 pixel = lens_center + lens_stretch * round_image((here - view_center) / view_focal_px, t);
#ifdef PLANE
    pixel = in_plane(pixel, plane_scale);
#endif
    vec2 right = dFdx(pixel), down = dFdy(pixel);
    float alpha = clamp((lens_t_max - t) / max(fwidth(t), 1e-12) + 0.5, 0.0, 1.0) * inside(pixel);
#ifdef COORDINATES
    fragment = vec4(pixel, t, alpha);
#elif defined(PLANE)
    fragment = mix(plane_black, taken(luma, pixel, right, down), alpha);
#else
    fragment = shown(picture(pixel, right, down) * alpha);
#endif
}

#endif
