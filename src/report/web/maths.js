// Vectors are arrays of three, turns are arrays of nine (rows), world to camera: x right, y down, z forward.
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = a => Math.sqrt(dot(a, a));
const unit = a => scale(a, 1 / (length(a) || 1));
const mix = (a, b, t) => a.map((x, i) => x + (b[i] - x) * t);
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
const row = (m, i) => [m[3 * i], m[3 * i + 1], m[3 * i + 2]];

const apply = (m, v) => [dot(row(m, 0), v), dot(row(m, 1), v), dot(row(m, 2), v)];
const applyBack = (m, v) => add(add(scale(row(m, 0), v[0]), scale(row(m, 1), v[1])), scale(row(m, 2), v[2]));
const multiply = (a, b) => [0, 1, 2].flatMap(i => applyBack(b, row(a, i)));
const transpose = m => [m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]];

// The turn by an angle about a unit axis.
function turnAbout(axis, angle) {
    const [x, y, z] = axis, c = Math.cos(angle), s = Math.sin(angle), d = 1 - c;
    return [c + x * x * d, x * y * d - z * s, x * z * d + y * s,
            y * x * d + z * s, c + y * y * d, y * z * d - x * s,
            z * x * d - y * s, z * y * d + x * s, c + z * z * d];
}

// Rows of unit length at right angles again, after many small turns.
function straighten(m) {
    const z = unit(row(m, 2)), x = unit(subtract(row(m, 0), scale(z, dot(row(m, 0), z))));
    return [...x, ...cross(z, x), ...z];
}

// A camera's turn that looks along `forward`, with `down` about downwards.
function looking(forward, down) {
    const z = unit(forward), x = unit(cross(down, z));
    return [...x, ...cross(z, x), ...z];
}

// From turn a to turn b, t in 0..1, about one axis.
function between(a, b, t) {
    const d = multiply(b, transpose(a)), angle = Math.acos(clamp((d[0] + d[4] + d[8] - 1) / 2, -1, 1));
    if (angle < 1e-6 || angle > Math.PI - 1e-3) return t < 0.5 ? a : b;
    const axis = unit([d[7] - d[5], d[2] - d[6], d[3] - d[1]]);
    return multiply(turnAbout(axis, angle * t), a);
}

// Of a camera: world to camera, three rows of four.
function poseOf(m) {
    const turn = [m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]];
    return { turn, centre: scale(applyBack(turn, [m[3], m[7], m[11]]), -1) };
}
