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

// A cloud's numbers where shaders find them, and the order it is drawn in.
function makeCloud(gl, { layer, n, data }) {
    const width = 2048, height = Math.max(1, Math.ceil(n / 512));
    const texture = makeTexture(gl, gl.NEAREST), padded = new Float32Array(4 * width * height);
    padded.set(data);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, padded);
    const array = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, 4 * Math.max(n, 1), gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
    gl.vertexAttribDivisor(0, 1);
    gl.bindVertexArray(null);
    return { layer, texture, array, buffer, shown: 0 };
}

function setOrder(gl, cloud, { order, n }) {
    gl.bindBuffer(gl.ARRAY_BUFFER, cloud.buffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, order, 0, n);
    cloud.shown = n;
}

// What clouds are blended into: floats of half or whole precision.
function makeTarget(gl, width, height, whole) {
    const texture = makeTexture(gl, whole ? gl.NEAREST : gl.LINEAR), frame = gl.createFramebuffer();
    gl.texStorage2D(gl.TEXTURE_2D, 1, whole ? gl.RGBA32F : gl.RGBA16F, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    return { width, height, whole, texture, frame };
}
