// The same picture as the program's: splatVertex is kernels/projection_body.h and kernels/shade_body.h, splatFragment
// kernels/raster.h, composeFragment kernels/pane_body.h, kernels/compose.h and image/tone.c.
const splatVertex = `#version 300 es
precision highp float;
precision highp sampler2D;
precision highp usampler2D;
uniform usampler2D order;     // which Gaussian is drawn when, 2048 a row
uniform sampler2D data;       // four texels a Gaussian, 512 a row
uniform mat3 turn;            // columns: the camera's rows
uniform vec3 centre;
uniform vec4 lens;            // fx, fy, cx, cy
uniform vec2 size;            // of the picture
uniform float near, far, dilation; // the last in pixels squared
uniform vec3 flash, tint;     // where it is; its gain, 0 without it
uniform float fall;           // distance at which it falls off by 1, squared; 0: it does not
uniform int what;             // 0 colour, 1 depth, 2 cover
uniform float least;          // no alpha under this is drawn
out vec2 at;                  // in standard deviations
flat out vec4 color;          // and opacity

void main() {
    int place = gl_VertexID >> 2, corner = gl_VertexID & 3;
    uint index = texelFetch(order, ivec2(place & 2047, place >> 11), 0).r;
    int x = int(index & 511u) * 4, y = int(index >> 9u);
    vec4 a = texelFetch(data, ivec2(x, y), 0), q = texelFetch(data, ivec2(x + 1, y), 0);
    vec4 b = texelFetch(data, ivec2(x + 2, y), 0), c = texelFetch(data, ivec2(x + 3, y), 0);
    gl_Position = vec4(2, 2, 2, 1);
    vec3 p = (a.xyz - centre) * turn;
    if (p.z < near || p.z > far) return;
    vec2 limit = 0.65 * size / lens.xy, t = clamp(p.xy / p.z, -limit, limit), j = lens.xy / p.z;
    mat3 rows = mat3(turn[0], turn[1], turn[2]);
    vec3 w0 = j.x * (rows[0] - t.x * rows[2]), w1 = j.y * (rows[1] - t.y * rows[2]);
    mat3 r = mat3( // columns: the Gaussian's axes
        1. - 2. * (q.y * q.y + q.z * q.z), 2. * (q.x * q.y + q.w * q.z), 2. * (q.x * q.z - q.w * q.y),
        2. * (q.x * q.y - q.w * q.z), 1. - 2. * (q.x * q.x + q.z * q.z), 2. * (q.y * q.z + q.w * q.x),
        2. * (q.x * q.z + q.w * q.y), 2. * (q.y * q.z - q.w * q.x), 1. - 2. * (q.x * q.x + q.y * q.y));
    vec3 v0 = (w0 * r) * b.xyz, v1 = (w1 * r) * b.xyz, m = cross(v0, v1);
    float xx = dilation + dot(v0, v0), xy = dot(v0, v1), yy = dilation + dot(v1, v1);
    float det = dot(m, m) + dilation * (xx + yy - dilation), mid = 0.5 * (xx + yy);
    float large = mid + length(vec2(0.5 * (xx - yy), xy)), small = det / large;
    vec2 axis = abs(xy) > 1e-9 * mid ? normalize(vec2(xy, large - xx)) : xx >= yy ? vec2(1, 0) : vec2(0, 1);
    float reach = sqrt(max(0., 2. * log(a.w / least)));
    at = reach * (2. * vec2(corner & 1, corner >> 1) - 1.);
    vec2 off = at.x * sqrt(large) * axis + at.y * sqrt(small) * vec2(-axis.y, axis.x);
    vec2 pixel = lens.xy * p.xy / p.z + lens.zw + off;
    gl_Position = vec4(2. * pixel.x / size.x - 1., 1. - 2. * pixel.y / size.y, 0, 1);
    vec3 d = a.xyz - flash;
    float gain = b.w * (fall > 0. ? fall / max(dot(d, d), 1e-4 * fall) : 1.);
    color = vec4(what == 1 ? vec3(p.z) : what == 2 ? vec3(c.w) : c.rgb * pow(1. + tint * gain, vec3(0.22)), a.w);
}`;

const splatFragment = `#version 300 es
precision highp float;
in vec2 at;
flat in vec4 color;
uniform float least;
out vec4 result;
void main() {
    float alpha = min(0.99, color.a * exp(-0.5 * dot(at, at)));
    if (alpha < least) discard;
    result = vec4(color.rgb * alpha, alpha);
}`;

const composeVertex = `#version 300 es
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1);
}`;

const composeFragment = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D T, F, R, B, C, colors; // T_N (or depth), T_F where it has a cloud of its own, R, beta, covers
uniform vec4 port;            // of the picture on the canvas: x, y, width, height
uniform mat3 turn;
uniform vec4 lens;            // of the picture on the canvas
uniform vec3 normal;
uniform float f0, dimming;
uniform bool pane, cloudBeta, covers;
uniform float flash;          // share of F's light over T's
uniform int layer;            // 0 both, 1 T, 2 R, 3 depth, 4 reflectance
uniform float reflection, exposure;
uniform mat3 camera;          // sRGB of the camera's colours
uniform bool plain;           // value = light^0.22, as in the program's files
uniform vec2 range;           // nearest and farthest depth
out vec4 result;

vec3 decode(vec3 x) {
    vec3 line = x * (1.19625533e-7 / 0.03);
    return mix(line, pow(max(x, 0.03), vec3(1. / 0.22)), vec3(greaterThanEqual(x, vec3(0.03))));
}
vec3 srgb(vec3 x) {
    vec3 curve = 1.055 * pow(max(x, 0.0031308), vec3(1. / 2.4)) - 0.055;
    return mix(12.92 * x, curve, vec3(greaterThan(x, vec3(0.0031308))));
}
vec3 pleasant(vec3 light) {
    vec3 x = max(light * camera * exposure, 0.), soft = 0.5 + 0.5 * (1. - exp(-(x - 0.5) / 0.5));
    return srgb(mix(x, soft, vec3(greaterThan(x, vec3(0.5)))));
}
vec4 depthColor(vec4 sum) {
    float z = sum.a >= 0.5 ? sum.r / sum.a : 0.;
    if (!(z > 0.)) return vec4(vec3(plain ? 0. : 0.15), 1);
    if (plain) return vec4(z, z, z, 1);
    float t = (1. / z - 1. / range.y) / (1. / range.x - 1. / range.y);
    return vec4(texture(colors, vec2((clamp(t, 0., 1.) * 255. + 0.5) / 256., 0.5)).rgb, 1);
}
void main() {
    vec2 pixel = gl_FragCoord.xy - port.xy, uv = pixel / port.zw;
    if (layer == 3) { result = depthColor(texture(T, uv)); return; }
    vec3 ray = normalize(turn * vec3((pixel.x - lens.z) / lens.x, (port.w - pixel.y - lens.w) / lens.y, 1));
    float u = 1. - abs(dot(ray, normal)), rho = 1. + 22. * u * u * u * u * u;
    float beta = 0., tau = 1.;
    if (pane) { beta = min(f0 * rho, 0.97); tau = (1. - min(dimming * rho, 0.97)) / (1. - dimming); }
    if (cloudBeta) beta = 1. / (1. + exp(-texture(B, uv).r));
    if (covers) beta *= 1. - min(texture(C, uv).r / 0.9, 1.);
    if (layer == 4) { result = vec4(vec3(plain ? beta : sqrt(beta)), 1); return; }
    vec3 light = vec3(0);
    if (layer != 2) {
        vec3 dark = decode(texture(T, uv).rgb);
        if (flash > 0.) dark += flash * (decode(texture(F, uv).rgb) - dark);
        light += tau * max(dark, 0.);
    }
    if (layer != 1) light += (layer == 2 ? 1. : reflection) * beta * decode(texture(R, uv).rgb);
    result = vec4(plain ? pow(max(light, 0.), vec3(0.22)) : pleasant(light), 1);
}`;
