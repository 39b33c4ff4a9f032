// Moves the camera: round what is looked at, across, towards it, along the photos' poses. Nothing jumps: a new pose is
// flown to.
class Walk {
    constructor(stage, views, focus) {
        this.stage = stage;
        this.views = views;
        this.focus = focus; // distance of what is looked at
        this.speed = focus;
        this.held = new Set();
        this.released = new Set(); // keys that were let go and still count until a frame has moved by them
        stage.onframe.push(time => this.tick(time));
    }

    get pose() {
        return this.stage.pose;
    }

    axes() {
        return [0, 1, 2].map(i => row(this.pose.turn, i));
    }

    set(turn, centre) {
        this.stage.look({ turn: straighten(turn), centre });
    }

    // About the point ahead, by angles to the right and down.
    orbit(right, down) {
        const { turn, centre } = this.pose, [x, , z] = this.axes(), at = add(centre, scale(z, this.focus));
        const turned = multiply(turnAbout(this.down, right), turnAbout(x, down));
        this.set(multiply(turn, transpose(turned)), add(at, apply(turned, subtract(centre, at))));
    }

    // Looks about from where it stands.
    glance(right, down) {
        const turned = multiply(turnAbout(this.down, right), turnAbout(this.axes()[0], down));
        this.set(multiply(this.pose.turn, transpose(turned)), this.pose.centre);
    }

    roll(angle) {
        this.set(multiply(turnAbout([0, 0, 1], angle), this.pose.turn), this.pose.centre);
    }

    // In shares of the distance to what is looked at: right, down, forward.
    move(right, down, forward) {
        const [x, y, z] = this.axes(), step = add(add(scale(x, right), scale(y, down)), scale(z, forward));
        this.set(this.pose.turn, add(this.pose.centre, scale(step, this.focus)));
    }

    // Nearer to what is looked at, never past it.
    dolly(by) {
        const near = Math.max(this.focus * Math.exp(-by), 1e-3 * this.speed);
        this.set(this.pose.turn, add(this.pose.centre, scale(this.axes()[2], this.focus - near)));
        this.focus = near;
    }

    fly(pose, milliseconds = 900) {
        this.stop();
        if (matchMedia('(prefers-reduced-motion: reduce)').matches) milliseconds = 0;
        this.flight = { from: this.pose, to: pose, begin: performance.now(), milliseconds };
        this.stage.request();
    }

    // Round the photos' mean pose, as wide as the photos are, looking at one point: render/spiral.h.
    play(on) {
        this.stop();
        if (on) this.path = { begin: performance.now(), ...this.loop() };
        this.stage.request();
    }

    loop() {
        const centres = this.views.map(v => v.pose.centre), n = centres.length;
        const mean = scale(centres.reduce(add), 1 / n);
        const turn = looking(this.forward, this.down), offsets = centres.map(c => apply(turn, subtract(c, mean)));
        const most = list => list.sort((a, b) => a - b)[Math.floor(0.9 * (n - 1))];
        const radius = [0, 1, 2].map(i => most(offsets.map(o => Math.abs(o[i]))));
        return { mean, turn, radius, at: add(mean, scale(this.forward, this.speed)) };
    }

    stop() {
        this.flight = this.path = null;
    }

    tick(time) {
        const seconds = clamp((time - (this.before ?? time - 16)) / 1000, 0, 0.1);
        this.before = time;
        if (this.flight) this.tickFlight();
        if (this.path) this.tickPath();
        if (this.held.size) this.tickKeys(seconds);
    }

    hold(key) {
        this.released.delete(key);
        this.held.add(key);
        this.stage.request();
    }

    // However short a key was pressed and however slow the frames are, it moves something.
    release(key) {
        this.released.add(key);
        this.stage.request();
    }

    releaseAll() {
        this.held.clear();
        this.released.clear();
    }

    tickFlight() {
        const { from, to, begin, milliseconds } = this.flight;
        const t = milliseconds ? clamp((performance.now() - begin) / milliseconds, 0, 1) : 1, s = t * t * (3 - 2 * t);
        const on = { turn: between(from.turn, to.turn, s), centre: mix(from.centre, to.centre, s) };
        this.stage.look(t === 1 ? to : on);
        if (t === 1) this.flight = null;
    }

    tickPath() {
        const { begin, mean, turn, radius, at } = this.path, angle = (performance.now() - begin) / 2600;
        const offset = [Math.cos(angle) * radius[0], Math.sin(angle) * radius[1], Math.sin(angle / 2) * radius[2]];
        const centre = add(mean, applyBack(turn, offset));
        this.stage.look({ turn: looking(subtract(at, centre), this.down), centre });
    }

    tickKeys(seconds) {
        const s = seconds * (this.held.has('shift') ? 2.5 : 0.6), held = key => this.held.has(key) ? s : 0;
        const move = [held('d') - held('a'), held('q') - held('e'), held('w') - held('s')];
        const turn = [held('arrowright') - held('arrowleft'), held('arrowdown') - held('arrowup')];
        if (move.some(Boolean)) this.move(...move.map(m => m * this.speed / this.focus));
        if (turn.some(Boolean)) this.orbit(-turn[0], turn[1]);
        for (const key of this.released) this.held.delete(key);
        this.released.clear();
        this.stage.request();
    }
}
