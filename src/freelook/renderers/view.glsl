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

out vec4 fragment;

// How much of a bilinear sample at `pixel` lies inside the picture; outside is black.
float inside(vec2 pixel) {
    vec2 size = vec2(textureSize(luma, 0));
    vec2 cover = clamp(pixel + 1.0, 0.0, 1.0) * clamp(size - pixel, 0.0, 1.0);
    return cover.x * cover.y;
}

vec3 picture(vec2 pixel) {
    vec2 at = (pixel + 0.5) / vec2(textureSize(luma, 0));
#if defined(PLANES) || defined(NV12)
    // A chroma sample sits in the middle of its 2 x 2 luma pixels, also at an odd border.
    vec2 chroma_at = (pixel + 0.5) / vec2(2 * textureSize(chroma_u, 0));
#ifdef NV12
    vec2 uv = texture(chroma_u, chroma_at).rg;
#else
    vec2 uv = vec2(texture(chroma_u, chroma_at).r, texture(chroma_v, chroma_at).r);
#endif
    return clamp(rgb_from_yuv * (vec3(texture(luma, at).r, uv) - yuv_offset), 0.0, 1.0);
#else
    return texture(luma, at).rgb;
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
        sum += picture(tap) * inside(tap);
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

void main() {
    vec2 here = pixel_from_fragment.xy * gl_FragCoord.xy + pixel_from_fragment.zw;
    vec3 ray = camera_from_view * vec3((here - view_center) / view_focal_px, 1.0);
    float size = length(ray);
    float depth = max(size + ray.z, 1e-5 * size);  // 0 straight behind, where no lens sees
    vec2 p = ray.xy / depth;
    float t = ray.z > 0.0 ? dot(p, p) : (size - ray.z) / depth;  // the same; each where exact
    vec2 pixel = lens_center + lens_stretch * (p * g_at(t) + offset_at(p));
    float alpha = clamp((lens_t_max - t) / max(fwidth(t), 1e-12) + 0.5, 0.0, 1.0) * inside(pixel);
#ifdef COORDINATES
    fragment = vec4(pixel, t, alpha);
#else
    fragment = shown(picture(pixel) * alpha);
#endif
}

#endif
