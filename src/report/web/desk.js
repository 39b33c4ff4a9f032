// The page around the canvas: buttons, sliders, and what an address says after its #.
class Desk {
    constructor(root) {
        this.root = root;
        this.stage = new Stage(root.querySelector('canvas'));
        this.status = root.querySelector('.status');
        this.say = text => { this.status.textContent = text; };
        this.place = { side: 0, up: 0, ahead: 0 }; // of the flash, from the camera
    }

    async open(scene, text) {
        for (const view of scene.views) view.pose = poseOf(view.w2c);
        this.root.style.setProperty('--frame', `${scene.views[0].width}/${scene.views[0].height}`);
        const clouds = await unpackClouds(scene.clouds, text);
        this.scene = scene;
        this.stage.open(scene, clouds);
        const depths = this.depthsOf(clouds[0]), percentile = p => depths[Math.floor(p * depths.length)];
        this.stage.renderer.range = [percentile(0.01), percentile(0.99)];
        this.walk = new Walk(this.stage, scene.views, depths[depths.length >> 1]);
        this.walk.forward = unit(scene.views.map(v => row(v.pose.turn, 2)).reduce(add));
        this.walk.down = unit(scene.views.map(v => row(v.pose.turn, 1)).reduce(add));
        this.film = new Film(scene.views, this.root.querySelector('.film'), this.root.querySelector('.beside'));
        this.ruler = new Ruler(this.stage, this.root.querySelector('.marks'), this.say);
        this.hands = new Hands(this.stage.canvas, this.walk, (x, y) => this.ruler.click(x, y));
        this.connect();
        this.root.querySelector('.panel').hidden = false;
        await this.begin();
    }

    // Of what the first cloud shows of itself in the first photo's frame, near ones first.
    depthsOf({ n, data }) {
        const { pose, fx, width } = this.scene.views[0], depths = [];
        for (let i = 0; i < n; i++) {
            const p = apply(pose.turn, subtract(data.subarray(FLOATS * i, FLOATS * i + 3), pose.centre));
            if (data[FLOATS * i + 3] > 0.5 && p[2] > 0 && Math.abs(p[0] / p[2]) < width / 2 / fx) depths.push(p[2]);
        }
        return depths.length ? depths.sort((a, b) => a - b) : [this.scene.extent || 1];
    }

    async begin() {
        this.home();
        this.read(location.hash.slice(1));
        await new Promise(done => {
            const drawn = this.stage.renderer.setOrders;
            this.stage.renderer.setOrders = orders => { // of the first one
                this.stage.renderer.setOrders = drawn;
                this.stage.renderer.setOrders(orders);
                done();
            };
        });
        this.stage.tryOut();
        this.root.classList.add('shown');
        this.say('');
    }

    connect() {
        const { root } = this, all = what => [...root.querySelectorAll(what)];
        all('[data-layer]').forEach(button => button.onclick = () => this.set('layer', button.dataset.layer));
        all('[data-set]').forEach(input => input.oninput = () => this.set(input.dataset.set, Number(input.value)));
        all('[data-do]').forEach(button => button.onclick = () => this[button.dataset.do](button));
        this.film.buttons.forEach((button, i) => button.onclick = () => this.stand(this.scene.views[i]));
        this.stage.onframe.push(() => this.follow());
        this.stage.flashFrom = pose => this.flashFrom(pose);
        this.stage.canvas.addEventListener('keydown', event => {
            const { clientWidth, clientHeight } = this.stage.canvas;
            if (event.key === 'Enter') this.ruler.click(clientWidth / 2, clientHeight / 2);
        });
        document.addEventListener('fullscreenchange', () =>
            this.press('full', document.fullscreenElement === root));
        const measure = root.querySelector('[data-do=measure]');
        if (!(this.scene.metres_per_unit > 0)) {
            measure.disabled = true;
            measure.title = 'The scale of this capture is not known: flashsplat run --metres-per-unit';
        }
        root.querySelector('[data-do=pin]').hidden = !this.scene.lit;
        root.querySelector('[data-do=full]').hidden = !document.fullscreenEnabled;
        const mirrored = this.scene.clouds.some(c => c.layer === 'R');
        for (const button of all('[data-layer=R], [data-layer=beta]')) button.hidden = !mirrored;
        const hide = (name, hidden) => { root.querySelector(`[data-set=${name}]`).parentNode.hidden = hidden; };
        hide('reflection', !mirrored);
        hide('flash', this.scene.shared && !this.scene.lit); // it would change nothing
        this.offerVr();
        addEventListener('hashchange', () => this.read(location.hash.slice(1)));
        this.follow();
    }

    offerVr() {
        return new Vr(this.stage, this.walk).offer(this.root.querySelector('[data-do=vr]'));
    }

    press(what, on) {
        this.root.querySelector(`[data-do=${what}]`).setAttribute('aria-pressed', on);
    }

    // A layer, or a slider's number.
    set(name, value) {
        const { show } = this.stage, input = this.root.querySelector(`[data-set=${name}]`);
        if (name === 'layer') show.layer = value;
        else if (name === 'stops') show.stops = value;
        else if (name === 'reflection' || name === 'flash') show[name] = value / 100;
        else this.place[name] = value / 100;
        if (input) input.value = value;
        this.stage.change();
        this.tell();
    }

    // What the controls say.
    tell() {
        const { show } = this.stage, { root, place } = this;
        const far = name => `${place[name] < 0 ? '\u2212' : ''}${Math.abs(Math.round(100 * place[name]))} %`;
        const text = { reflection: `${Math.round(100 * show.reflection)} %`, flash: this.flashText(show.flash),
                       stops: `${show.stops > 0 ? '+' : ''}${show.stops.toFixed(1)} stops`,
                       side: far('side'), up: far('up'), ahead: far('ahead') };
        for (const input of root.querySelectorAll('[data-set]')) {
            input.previousElementSibling.textContent = text[input.dataset.set];
            input.setAttribute('aria-valuetext', text[input.dataset.set]);
        }
        for (const button of root.querySelectorAll('[data-layer]'))
            button.setAttribute('aria-pressed', button.dataset.layer === show.layer);
        root.querySelector('[data-set=reflection]').disabled = show.layer !== 'both';
        root.querySelector('.place').hidden = !(this.scene.lit && show.flash > 0);
    }

    flashText(flash) {
        return flash === 0 ? 'off' : flash === 1 ? 'on' : `${Math.round(100 * flash)} %`;
    }

    // Where the flash is for who looks from there.
    flashFrom(pose) {
        const { place } = this, at = this.pinned || pose;
        const step = scale([place.side, -place.up, place.ahead], this.scene.flash_distance);
        return add(at.centre, applyBack(at.turn, step));
    }

    // Before each frame: the flash stays at its place, the nearest photo is shown.
    follow() {
        const { stage } = this, { pose, show } = stage;
        show.flashAt = this.flashFrom(pose);
        if (!this.film.beside.hidden) this.film.showNearest(pose, show.flash > 0.5);
        const stands = this.scene.views.find(v => v.pose.centre === pose.centre);
        if (stands !== this.stands) this.film.mark(this.stands = stands);
        if (this.playing !== !!this.walk.path) this.press('play', this.playing = !!this.walk.path); // hands stop it too
    }

    stand(view, milliseconds) {
        this.stage.lensOf = view;
        this.press('play', this.playing = false);
        this.walk.focus = this.walk.speed;
        this.walk.fly(view.pose, milliseconds);
    }

    // ---- what the buttons do ----

    beside() {
        const on = this.film.beside.hidden;
        this.film.beside.hidden = !on;
        this.root.classList.toggle('beside', on);
        this.press('beside', on);
        this.stage.change();
    }

    play(button) {
        const on = button.getAttribute('aria-pressed') !== 'true';
        this.walk.play(on);
        this.press('play', this.playing = on);
    }

    measure(button) {
        const on = button.getAttribute('aria-pressed') !== 'true';
        this.ruler.turn(on);
        this.root.classList.toggle('measuring', on);
        this.press('measure', on);
    }

    pin() {
        this.pinned = this.pinned ? null : this.stage.pose;
        this.press('pin', !!this.pinned);
        this.stage.change();
    }

    home() {
        this.pinned = null;
        this.press('pin', false);
        for (const [name, value] of [['layer', 'both'], ['reflection', 100], ['flash', 0], ['stops', 0], ['side', 0],
                                     ['up', 0], ['ahead', 0]]) this.set(name, value);
        const { views } = this.scene, middle = scale(views.map(v => v.pose.centre).reduce(add), 1 / views.length);
        const away = view => length(subtract(view.pose.centre, middle));
        this.stand(views.reduce((a, b) => away(a) <= away(b) ? a : b), this.root.classList.contains('shown') ? 900 : 0);
    }

    full() {
        if (document.fullscreenElement) document.exitFullscreen();
        else this.root.requestFullscreen();
    }

    // A PNG (data:) of any camera, at its size, as the program's own files are: value = light^0.22.
    async picture(camera, show) {
        const { stage } = this;
        stage.fixed = [camera.width, camera.height];
        stage.lensOf = camera;
        Object.assign(stage.show, { plain: true }, show);
        stage.look(poseOf(camera.w2c));
        await stage.settled();
        return stage.canvas.toDataURL();
    }

    // #view=IMG_0001&layer=T&reflection=50&flash=100&stops=1: docs/viewer.md has all of it.
    read(text) {
        const words = new URLSearchParams(text), view = this.scene.views.find(v => v.name === words.get('view'));
        if (LAYERS.includes(words.get('layer'))) this.set('layer', words.get('layer'));
        for (const name of ['reflection', 'flash', 'stops'])
            if (words.has(name) && isFinite(words.get(name))) this.set(name, Number(words.get(name)));
        if (view) this.stand(view, 0);
    }
}
