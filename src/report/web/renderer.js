// Draws a scene from a pose: each cloud sorted and blended for itself in tone-mapped colours, then one pass that puts
// them together in linear light, as the program does (kernels/compose.h).
const LAYERS = ['both', 'T', 'R', 'depth', 'beta'];

class Renderer {
    constructor(canvas) {
        const gl = this.gl = canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false,
                                                           powerPreference: 'high-performance', xrCompatible: !!navigator.xr });
        if (!gl) throw new Error('this browser has no WebGL 2');
        if (!gl.getExtension('EXT_color_buffer_float') && !gl.getExtension('EXT_color_buffer_half_float'))
            throw new Error('this graphics card cannot blend light');
        this.canBlendWhole = !!(gl.getExtension('EXT_color_buffer_float') && gl.getExtension('EXT_float_blend'));
        this.splat = makeProgram(gl, splatVertex, splatFragment);
        this.compose = makeProgram(gl, composeVertex, composeFragment);
        this.plain = gl.createVertexArray();
        this.colors = makeTexture(gl, gl.LINEAR);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, depthColors());
        this.targets = new Map();
    }

    open(scene, clouds) {
        this.scene = scene;
        this.clouds = clouds.map(cloud => makeCloud(this.gl, cloud));
        this.quads = makeQuads(this.gl, Math.max(...clouds.map(cloud => cloud.n)));
        this.near = 0.1 * scene.extent;
    }

    setOrders(orders) {
        orders.forEach((order, i) => setOrder(this.gl, this.clouds[i], order));
    }

    target(name, width, height, whole) {
        const gl = this.gl, old = this.targets.get(name);
        if (old && old.width === width && old.height === height && old.whole === whole) return old;
        if (old) {
            gl.deleteTexture(old.texture);
            gl.deleteFramebuffer(old.frame);
        }
        const made = makeTarget(gl, width, height, whole);
        this.targets.set(name, made);
        return made;
    }

    // pose: { turn, centre }; lens: fx, fy, cx, cy in pixels of size; light: { gain, at }.
    blend(layer, pose, lens, size, { light, whole, what, only, rough, far }) {
        const gl = this.gl, { at, program } = this.splat, scene = this.scene;
        const cloud = this.clouds.find(c => c.layer === layer);
        const target = this.target(layer + (what ? ` ${what}` : ''), ...size, whole);
        gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
        gl.viewport(0, 0, ...size);
        gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
        if (!cloud) return target.texture;
        gl.useProgram(program);
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, cloud.texture);
        gl.uniform1i(at.data, 0);
        gl.activeTexture(gl.TEXTURE1);
        gl.bindTexture(gl.TEXTURE_2D, cloud.order);
        gl.uniform1i(at.order, 1);
        gl.uniform1f(at.least, rough ? 0.02 : 1 / 255);
        gl.uniformMatrix3fv(at.turn, false, pose.turn);
        gl.uniform3fv(at.centre, pose.centre);
        gl.uniform4fv(at.lens, lens);
        gl.uniform2fv(at.size, size);
        gl.uniform1f(at.near, this.near);
        gl.uniform1f(at.far, far || 1e30);
        gl.uniform1f(at.dilation, this.dilation(lens));
        gl.uniform3fv(at.flash, light ? light.at : pose.centre);
        gl.uniform3fv(at.tint, scene.gain_color.map(g => light ? g * light.gain : 0));
        gl.uniform1f(at.fall, scene.even ? 0 : scene.flash_distance ** 2);
        gl.uniform1i(at.what, ['', 'depth', 'cover'].indexOf(what || ''));
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        if (only) {
            gl.enable(gl.SCISSOR_TEST);
            gl.scissor(...only);
        }
        gl.bindVertexArray(this.quads);
        gl.drawElements(gl.TRIANGLES, 6 * cloud.shown, gl.UNSIGNED_INT, 0);
        gl.bindVertexArray(null);
        gl.disable(gl.SCISSOR_TEST);
        gl.disable(gl.BLEND);
        return target.texture;
    }

    // The program's 0.3 pixels; where a pixel of the photos is larger than one of ours, 0.3 of that, as it was trained.
    dilation(lens) {
        return 0.3 * Math.max(1, lens[0] / this.scene.views[0].fx) ** 2;
    }

    // What the layer asks for: { T, F, R, B, C }, textures.
    blendAll(pose, lens, size, show) {
        const { scene } = this, { layer, flash } = show, whole = show.whole && this.canBlendWhole;
        const at = show.flashAt || pose.centre, lit = scene.lit && flash > 0;
        const T = layer !== 'R' && layer !== 'beta', R = layer === 'both' || layer === 'R';
        const { rough } = show;
        const draw = (name, light, what) => this.blend(name, pose, lens, size, { light, whole, what, rough });
        const made = {};
        if (layer === 'depth') return { T: draw('T_N', null, 'depth') };
        if (T) made.T = draw('T_N', lit ? { gain: flash, at } : null);
        if (T && !scene.shared && flash > 0) made.F = draw('T_F');
        if (R) made.R = draw('R', lit ? { gain: flash * scene.flash_return, at } : null);
        if (!scene.pane && layer !== 'T') made.B = draw('beta');
        if (layer !== 'T' && this.clouds.some(c => c.covers)) made.C = draw('T_N', null, 'cover');
        return made;
    }

    // Into port (x, y, width, height) of `frame` (null: the canvas), from pictures of `share` its size.
    draw(pose, lens, port, show, frame = null) {
        const gl = this.gl, { at, program } = this.compose, { scene } = this, share = show.share || 1;
        const size = [2, 3].map(i => Math.max(1, Math.round(port[i] * share)));
        const sx = size[0] / port[2], sy = size[1] / port[3];
        const made = this.blendAll(pose, [lens[0] * sx, lens[1] * sy, lens[2] * sx, lens[3] * sy], size, show);
        gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
        gl.viewport(...port);
        gl.useProgram(program);
        ['T', 'F', 'R', 'B', 'C'].forEach((name, unit) => {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(gl.TEXTURE_2D, made[name] || this.colors);
            gl.uniform1i(at[name], unit);
        });
        gl.activeTexture(gl.TEXTURE5);
        gl.bindTexture(gl.TEXTURE_2D, this.colors);
        gl.uniform1i(at.colors, 5);
        gl.uniform4fv(at.port, port);
        gl.uniformMatrix3fv(at.turn, false, pose.turn);
        gl.uniform4fv(at.lens, lens);
        gl.uniform3fv(at.normal, unit(scene.normal));
        gl.uniform1f(at.f0, scene.f0);
        gl.uniform1f(at.dimming, scene.dimming);
        gl.uniform1i(at.pane, scene.pane ? 1 : 0);
        gl.uniform1i(at.cloudBeta, made.B ? 1 : 0);
        gl.uniform1i(at.covers, made.C ? 1 : 0);
        gl.uniform1f(at.flash, made.F ? show.flash : 0);
        gl.uniform1i(at.layer, LAYERS.indexOf(show.layer));
        gl.uniform1f(at.reflection, show.reflection);
        gl.uniform1f(at.exposure, scene.exposure * 2 ** show.stops);
        gl.uniformMatrix3fv(at.camera, false, scene.matrix); // its columns are the matrix's rows
        gl.uniform1i(at.plain, show.plain ? 1 : 0);
        gl.uniform2fv(at.range, this.range || [1, 2]);
        gl.bindVertexArray(this.plain);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        gl.bindVertexArray(null);
    }

    // The depth of T at a pixel of a picture of that size, where half of the light is stopped; 0 where less is.
    depthAt(pose, lens, size, pixel) {
        const gl = this.gl, x = Math.floor(pixel[0]), y = size[1] - 1 - Math.floor(pixel[1]);
        const half = far => { // by what is nearer than that
            this.blend('T_N', pose, lens, size, { what: 'depth', whole: this.canBlendWhole, only: [x, y, 1, 1], far });
            const sum = new Float32Array(4);
            gl.readPixels(x, y, 1, 1, gl.RGBA, gl.FLOAT, sum);
            return sum[3] >= 0.5;
        };
        if (!half()) return 0;
        let low = this.near, high = 2 * low;
        while (!half(high)) [low, high] = [high, 2 * high];
        while (high > 1.001 * low) {
            const middle = Math.sqrt(low * high);
            if (half(middle)) high = middle;
            else low = middle;
        }
        return high;
    }
}
