// The picture on the canvas: half floats and fewer pixels while something moves, all of them in whole floats once it
// rests. A frame is drawn only when something changed.
const REST = 160; // milliseconds without change until the picture is drawn at its best

class Stage {
    constructor(canvas) {
        this.canvas = canvas;
        this.renderer = new Renderer(canvas);
        this.show = { layer: 'both', reflection: 1, flash: 0, stops: 0, plain: false, flashAt: null };
        this.pose = { turn: [1, 0, 0, 0, 1, 0, 0, 0, 1], centre: [0, 0, 0] };
        this.share = 1;     // of the pixels' sides, while moving
        this.most = 1;      // of share
        this.rest = 1;      // the same at rest: under 1 only where a picture would take seconds
        this.stamp = 0;     // of the pose
        this.sorted = -1;   // of the pose that the order is of
        this.fixed = null;  // [width, height] instead of what the page has room for
        this.changed = 0;
        this.best = false;  // the picture is at its best
        this.waiting = [];
        this.flashFrom = () => null; // where the flash is for a pose; null: at it
        this.onframe = [];  // called with the time in ms before a frame
        canvas.addEventListener('webglcontextlost', event => {
            event.preventDefault();
            this.lost = true;
            const status = document.querySelector('#viewer .status');
            if (status) status.textContent = 'The graphics card took the 3D picture away; reload the page to see it again.';
        });
        canvas.addEventListener('webglcontextrestored', () => location.reload());
        new ResizeObserver(() => this.change()).observe(canvas);
    }

    open(scene, clouds) {
        this.scene = scene;
        this.renderer.open(scene, clouds);
        this.sorter = new Sorter(clouds, this.renderer.near, ({ stamp, sorted }) => {
            this.renderer.setOrders(sorted);
            this.sorted = stamp;
            this.request();
        });
        this.lensOf = scene.views[0];
    }

    look(pose) {
        this.pose = pose;
        this.stamp++;
        this.change();
        this.sorter.ask(pose, this.stamp);
    }

    change() {
        this.changed = performance.now();
        this.best = false;
        this.request();
    }

    request() {
        if (!this.asked && !this.paused) this.asked = requestAnimationFrame(time => this.frame(time));
    }

    // Of the canvas, in its pixels.
    size() {
        if (this.fixed) return this.fixed;
        const scale = Math.min(window.devicePixelRatio || 1, 2);
        return [this.canvas.clientWidth, this.canvas.clientHeight].map(x => Math.max(1, Math.round(x * scale)));
    }

    // The whole of the photo's frame, as large as it fits.
    lens() {
        const [width, height] = this.size(), view = this.lensOf;
        const s = Math.min(width / view.width, height / view.height);
        return [view.fx * s, view.fy * s, width / 2 + (view.cx - view.width / 2) * s,
                height / 2 + (view.cy - view.height / 2) * s];
    }

    frame(time) {
        this.asked = 0;
        for (const call of this.onframe) call(time);
        if (this.lost || this.paused || !this.sorter || this.sorted < 0) return;
        const resting = performance.now() - this.changed > REST && this.sorted === this.stamp;
        if (resting && !this.best) {
            this.draw(true);
            this.best = true;
            this.most = 1;
            this.before = 0; // a rest is no late frame
            this.waiting.splice(0).forEach(done => done());
        } else if (!resting) {
            this.measure(time);
            this.draw(false);
            this.request();
        }
    }

    draw(whole) {
        const size = this.size(), share = whole ? this.fixed ? 1 : this.rest : this.share;
        if (this.canvas.width !== size[0] || this.canvas.height !== size[1])
            [this.canvas.width, this.canvas.height] = size;
        this.renderer.draw(this.pose, this.lens(), [0, 0, ...size], { ...this.show, whole: whole && share === 1, share,
                                                                             rough: !whole && share < 1 });
        this.drawn = true;
        if (this.ondraw) this.ondraw();
    }

    // Keeps motion smooth: fewer pixels when frames come late, more when there is room.
    measure(time) {
        const took = time - (this.before || time);
        this.before = time;
        if (took <= 0 || took > 1000) return;
        this.pace = (this.pace || 16) * 0.8 + took * 0.2;
        if (this.pace > 20 && this.share > 0.25) {
            this.most = 0.95 * this.share; // what was too much is not tried again until it rested
            this.step(0.85);
        } else if (this.pace < 17.5 && this.share < this.most) {
            this.step(1.08);
        }
    }

    step(by) {
        this.share = clamp(this.share * by, 0.25, this.most < 1 && by > 1 ? this.most : 1);
        this.pace = 18.5;
    }

    // The first picture, small, with whatever the browser has to make ready for it; then how fast the machine is: where
    // all pixels would take longer than a second and a half, fewer are drawn at rest.
    tryOut() {
        this.timed(0.25);
        requestAnimationFrame(() => {
            const quarter = this.timed(0.25);
            if (quarter > 60) {
                const pixels = Math.max(0, this.timed(0.5) - quarter) / (0.25 - 0.0625);
                const rest = quarter - 0.0625 * pixels;
                this.rest = clamp(Math.sqrt((1500 - rest) / Math.max(pixels, 1)) || 0, 0.4, 1);
            }
            this.share = clamp(0.25 * Math.sqrt(20 / quarter), 0.25, 1);
            this.change();
        });
    }

    timed(share) {
        const { gl } = this.renderer, begin = performance.now();
        this.share = share;
        this.draw(false);
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        return performance.now() - begin;
    }

    // A promise of the picture at its best.
    settled() {
        this.change();
        return new Promise(done => this.waiting.push(done));
    }

    depthAt(x, y) { // CSS pixels
        const scale = this.size()[0] / this.canvas.clientWidth;
        return this.renderer.depthAt(this.pose, this.lens(), this.size(), [x * scale, y * scale]);
    }

    // The place in the world that a CSS pixel at depth z shows, and back.
    placeAt(x, y, z) {
        const [fx, fy, cx, cy] = this.lens(), scale = this.size()[0] / this.canvas.clientWidth;
        const ray = [(x * scale - cx) / fx * z, (y * scale - cy) / fy * z, z];
        return add(this.pose.centre, applyBack(this.pose.turn, ray));
    }

    pixelOf(place) {
        const [fx, fy, cx, cy] = this.lens(), scale = this.size()[0] / this.canvas.clientWidth;
        const [x, y, z] = apply(this.pose.turn, subtract(place, this.pose.centre));
        return z > 0 ? [(fx * x / z + cx) / scale, (fy * y / z + cy) / scale] : null;
    }
}
