// WebXR, where the browser offers it: the scene at the size that its photos were taken in, or as if what one looks at
// were two metres away; one stands where the page's camera stood.
class Vr {
    constructor(stage, walk) {
        this.stage = stage;
        this.walk = walk;
    }

    async offer(button) {
        if (!navigator.xr || !await navigator.xr.isSessionSupported('immersive-vr').catch(() => false)) return;
        button.hidden = false;
        button.onclick = () => this.session ? this.session.end() : this.enter().catch(why => console.warn(why));
    }

    async enter() {
        const session = this.session = await navigator.xr.requestSession('immersive-vr'), { gl } = this.stage.renderer;
        session.onend = () => {
            this.session = null;
            if (!this.stage.paused) return; // it never began
            this.stage.paused = false;
            this.stage.look(this.home);
        };
        try {
            await gl.makeXRCompatible();
            await this.begin(session, new XRWebGLLayer(session, gl, { antialias: false, depth: false }));
        } catch (why) {
            session.end();
            throw why;
        }
    }

    async begin(session, layer) {
        session.updateRenderState({ baseLayer: layer });
        const space = await session.requestReferenceSpace('local');
        this.units = this.stage.scene.metres_per_unit > 0 ? 1 / this.stage.scene.metres_per_unit : this.walk.focus / 2;
        this.home = this.stage.pose;
        this.stage.paused = true;
        const frame = (time, xr) => {
            session.requestAnimationFrame(frame);
            const viewer = xr.getViewerPose(space);
            if (viewer) this.draw(viewer, layer);
        };
        session.requestAnimationFrame(frame);
    }

    // From WebXR's axes (y up, z back), in metres, to ours.
    poseOf({ matrix: m }) {
        const turn = [m[0], m[1], m[2], -m[4], -m[5], -m[6], -m[8], -m[9], -m[10]].map((x, i) => i % 3 ? -x : x);
        const place = scale([m[12], -m[13], -m[14]], this.units);
        return { turn: multiply(turn, this.home.turn),
                 centre: add(this.home.centre, applyBack(this.home.turn, place)) };
    }

    draw(viewer, layer) {
        const { stage } = this, { renderer } = stage;
        const head = this.poseOf(viewer.transform);
        stage.sorter.ask(head, ++stage.stamp);
        for (const view of viewer.views) {
            const { x, y, width, height } = layer.getViewport(view), p = view.projectionMatrix;
            const lens = [p[0] * width / 2, p[5] * height / 2, (1 - p[8]) * width / 2, (1 + p[9]) * height / 2];
            const show = { ...stage.show, flashAt: stage.flashFrom(head), whole: false, share: Math.min(1, Math.max(stage.share, 0.5)) };
            renderer.draw(this.poseOf(view.transform), lens, [x, y, width, height], show, layer.framebuffer);
        }
    }
}
