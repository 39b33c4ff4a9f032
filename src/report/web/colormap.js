// The colours of depth: image/colormap.c as 256 RGBA texels.
function depthColors() {
    const inverse = t => t > 6 / 29 ? t ** 3 : 3 * (6 / 29) ** 2 * (t - 4 / 29);
    const encode = x => x <= 0.0031308 ? 12.92 * Math.max(x, 0) : 1.055 * x ** (1 / 2.4) - 0.055;
    const texel = new Uint8Array(4 * 256);
    for (let i = 0; i < 256; i++) {
        const t = i / 255, hue = (310 - 210 * t) * Math.PI / 180, chroma = 30 + 62 * t ** 4;
        const fy = (30 + 76 * t) / 116, a = chroma * Math.cos(hue), b = chroma * Math.sin(hue);
        const x = 0.95047 * inverse(fy + a / 500), y = inverse(fy), z = 1.08883 * inverse(fy - b / 200);
        const rgb = [3.2404542 * x - 1.5371385 * y - 0.4985314 * z, -0.969266 * x + 1.8760108 * y + 0.041556 * z,
                     0.0556434 * x - 0.2040259 * y + 1.0572252 * z];
        texel.set([...rgb.map(v => 255 * Math.min(1, encode(v)) + 0.5), 255], 4 * i);
    }
    return texel;
}
