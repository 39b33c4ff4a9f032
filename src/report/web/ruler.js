// The distance between two clicks on the transmitted scene, in metres where the capture's scale is known.
class Ruler {
    constructor(stage, svg, say) {
        this.stage = stage;
        this.svg = svg;
        this.say = say;
        this.ends = [];
        stage.ondraw = () => this.draw();
    }

    turn(on) {
        this.on = on;
        this.ends = [];
        this.draw();
        this.say(on ? 'Click two places behind the glass.' : '');
    }

    click(x, y) {
        if (!this.on) return;
        const z = this.stage.depthAt(x, y);
        this.stage.change(); // the depth was drawn over the picture's place
        if (!z) return this.say('Nothing is there to measure from.');
        if (this.ends.length === 2) this.ends = [];
        this.ends.push(this.stage.placeAt(x, y, z));
        this.say(this.ends.length === 2 ? this.text() : 'And the other end.');
        this.draw();
    }

    text() {
        const units = length(subtract(...this.ends)), metres = units * this.stage.scene.metres_per_unit;
        return metres < 1 ? `${(100 * metres).toFixed(1)} cm` : `${metres.toFixed(2)} m`;
    }

    draw() {
        const at = this.ends.map(end => this.stage.pixelOf(end)).filter(Boolean), f = x => x.toFixed(1);
        let marks = at.map(([x, y]) => `<circle cx="${f(x)}" cy="${f(y)}" r="5"/>`).join('');
        if (at.length === 2) {
            const [[x, y], [u, v]] = at;
            marks = `<line x1="${f(x)}" y1="${f(y)}" x2="${f(u)}" y2="${f(v)}"/>${marks}` +
                `<text x="${f((x + u) / 2)}" y="${f((y + v) / 2 - 10)}">${this.text()}</text>`;
        }
        if (marks !== this.marks) this.svg.innerHTML = this.marks = marks;
    }
}
