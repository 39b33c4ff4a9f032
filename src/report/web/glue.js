// The few words of WebGL that the renderer is written in.
function makeProgram(gl, vertex, fragment) {
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, text);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
        const why = gl.getAttachedShaders(program).map(s => gl.getShaderInfoLog(s)).join(' ');
        throw new Error(`shaders: ${gl.getProgramInfoLog(program)} ${why}`);
    }
    const at = {};
    for (let i = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; i >= 0; i--) {
        const { name } = gl.getActiveUniform(program, i);
        at[name] = gl.getUniformLocation(program, name);
    }
    return { program, at };
}

function makeTexture(gl, filter) {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const [what, value] of [[gl.TEXTURE_MIN_FILTER, filter], [gl.TEXTURE_MAG_FILTER, filter],
                                 [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]])
        gl.texParameteri(gl.TEXTURE_2D, what, value);
    return texture;
}

// A cloud's numbers where shaders find them, and the order it is drawn in: a texture too, since a vertex knows its
// number, and instances of four vertices are slow on many cards.
function makeCloud(gl, { layer, n, covers, data }) {
    const height = Math.max(1, Math.ceil(n / 512)), rows = Math.max(1, Math.ceil(n / 2048));
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (height > most) throw new Error(`this graphics card takes ${512 * most} Gaussians a cloud, ${layer} has ${n}`);
    const texture = makeTexture(gl, gl.NEAREST), padded = new Float32Array(4 * 2048 * height);
    padded.set(data);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 2048, height, 0, gl.RGBA, gl.FLOAT, padded);
    const order = makeTexture(gl, gl.NEAREST);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R32UI, 2048, rows);
    return { layer, n, covers, texture, order, numbers: new Uint32Array(2048 * rows), shown: 0 };
}

function setOrder(gl, cloud, { order, n }) {
    cloud.numbers.set(order.subarray(0, n));
    cloud.shown = n;
    gl.bindTexture(gl.TEXTURE_2D, cloud.order);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 2048, Math.ceil(n / 2048), gl.RED_INTEGER, gl.UNSIGNED_INT, cloud.numbers);
}

// Two triangles each of n quads, whose corners are the numbers 4 i .. 4 i + 3.
function makeQuads(gl, n) {
    const corner = new Uint32Array(6 * n), array = gl.createVertexArray();
    for (let i = 0; i < n; i++) corner.set([4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 2, 4 * i + 1, 4 * i + 3], 6 * i);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corner, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return array;
}

// What clouds are blended into: floats of half or whole precision.
function makeTarget(gl, width, height, whole) {
    const texture = makeTexture(gl, whole ? gl.NEAREST : gl.LINEAR), frame = gl.createFramebuffer();
    gl.texStorage2D(gl.TEXTURE_2D, 1, whole ? gl.RGBA32F : gl.RGBA16F, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    return { width, height, whole, texture, frame };
}
