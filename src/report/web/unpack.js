// scene.js back into numbers: report/text7.h and report/pack.h say what it holds.
const FLOATS = 16; // of a Gaussian: place, opacity; turn; size, flash gain; colour, cover

function fromText7(text) {
    const byte = new Uint8Array(text.length * 7 >> 3);
    let bits = 0, have = 0, n = 0;
    for (let i = 0; i < text.length; i++) {
        bits |= text.charCodeAt(i) << have;
        have += 7;
        if (have < 8) continue;
        byte[n++] = bits & 255;
        bits >>= 8;
        have -= 8;
    }
    return byte;
}

async function inflate(byte) {
    if (!window.DecompressionStream) throw new Error('this browser is older than 2023');
    const stream = new Blob([byte]).stream().pipeThrough(new DecompressionStream('deflate'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

const valuesOf = ([low, high, bits]) => q => low + (high - low) * q / (2 ** bits - 1);

function putPlaces(cloud, plane, to) {
    const at = [0, 0, 0];
    for (let i = 0; i < cloud.n; i++)
        for (let k = 0; k < 3; k++) {
            const zigzag = plane(2 * k)[i] << 8 | plane(2 * k + 1)[i];
            at[k] += zigzag & 1 ? -(zigzag + 1 >> 1) : zigzag >> 1;
            const u = cloud.low[k] + cloud.step * at[k];
            to[FLOATS * i + k] = cloud.centre[k] + Math.sign(u) * cloud.reach * Math.expm1(Math.abs(u));
        }
}

function putShapes(cloud, plane, to) {
    const size = valuesOf(cloud.size), turn = valuesOf(cloud.turn);
    for (let i = 0; i < cloud.n; i++) {
        const o = FLOATS * i, q = [0, 1, 2].map(k => turn(plane(9 + k)[i]));
        for (let k = 0; k < 3; k++) to[o + 8 + k] = Math.exp(size(plane(6 + k)[i]));
        to.set(q, o + 4);
        to[o + 7] = Math.sqrt(Math.max(0, 1 - dot(q, q)));
    }
}

function putLooks(cloud, plane, to) {
    const opacity = valuesOf(cloud.opacity), color = valuesOf(cloud.color), gain = valuesOf(cloud.gain);
    const three = cloud.colors === 3, most = 2 ** cloud.color[2] - 1;
    for (let i = 0; i < cloud.n; i++) {
        const o = FLOATS * i, green = plane(13)[i];
        const signed = p => plane(p)[i] << 24 >> 24;
        to[o + 3] = opacity(plane(12)[i]) ** 2;
        to[o + 11] = cloud.gains ? Math.exp(gain(plane(13 + cloud.colors)[i])) : 1;
        to[o + 15] = cloud.covers ? plane(13 + cloud.colors + cloud.gains)[i] / 63 : 0;
        to[o + 12] = color(three ? clamp(green + signed(14), 0, most) : green);
        to[o + 13] = color(green);
        to[o + 14] = color(three ? clamp(green + signed(15), 0, most) : green);
    }
}

// { layer, n, data } of each cloud.
async function unpackClouds(clouds, text) {
    const byte = await inflate(fromText7(text));
    let at = 0;
    return clouds.map(cloud => {
        const begin = at, data = new Float32Array(FLOATS * cloud.n);
        const plane = p => byte.subarray(begin + p * cloud.n, begin + (p + 1) * cloud.n);
        const planes = Array.from({ length: 13 + cloud.colors + cloud.gains + (cloud.covers || 0) }, (_, p) => plane(p));
        at += planes.length * cloud.n;
        if (at > byte.length) throw new Error('the scene is cut off');
        for (const put of [putPlaces, putShapes, putLooks]) put(cloud, p => planes[p], data);
        return { layer: cloud.layer, n: cloud.n, covers: cloud.covers, data };
    });
}
