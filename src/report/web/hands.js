// Mouse, touch and keys on the canvas.
const WALK_KEYS = ['w', 'a', 's', 'd', 'q', 'e', 'arrowleft', 'arrowright', 'arrowup', 'arrowdown'];

class Hands {
    constructor(canvas, walk, click) {
        this.walk = walk;
        this.fingers = new Map();
        canvas.addEventListener('pointerdown', event => this.down(canvas, event));
        canvas.addEventListener('pointermove', event => this.drag(canvas, event));
        for (const end of ['pointerup', 'pointercancel'])
            canvas.addEventListener(end, event => this.up(canvas, event, end === 'pointerup' ? click : null));
        canvas.addEventListener('contextmenu', event => event.preventDefault());
        canvas.addEventListener('wheel', event => {
            event.preventDefault();
            walk.stop();
            walk.dolly(-clamp(event.deltaY * (event.deltaMode ? 16 : 1), -200, 200) / 600);
        }, { passive: false });
        canvas.addEventListener('keydown', event => this.key(event, true));
        canvas.addEventListener('keyup', event => this.key(event, false));
        canvas.addEventListener('blur', () => walk.releaseAll());
    }

    down(canvas, event) {
        canvas.setPointerCapture(event.pointerId);
        canvas.focus({ preventScroll: true });
        this.fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
        this.travelled = this.fingers.size > 1 ? Infinity : 0;
    }

    up(canvas, event, click) {
        this.fingers.delete(event.pointerId);
        if (click && event.button === 0 && this.travelled < 6) click(event.offsetX, event.offsetY);
    }

    drag(canvas, event) {
        const old = this.fingers.get(event.pointerId), now = [event.offsetX, event.offsetY];
        if (!old) return;
        const step = [now[0] - old[0], now[1] - old[1]], unit = canvas.clientHeight;
        this.travelled += Math.hypot(...step);
        if (this.travelled < 6) return; // a click that trembles
        this.fingers.set(event.pointerId, now);
        this.walk.stop();
        if (this.fingers.size === 2) this.pinch(event.pointerId, old, now, unit);
        else if (event.buttons & 6 || event.shiftKey) this.walk.move(-step[0] / unit, -step[1] / unit, 0);
        else if (event.ctrlKey || event.altKey) this.walk.glance(-step[0] / unit, step[1] / unit);
        else this.walk.orbit(1.6 * step[0] / unit, -1.6 * step[1] / unit);
    }

    // Two fingers: across, towards, round.
    pinch(id, old, now, unit) {
        const other = [...this.fingers].find(([key]) => key !== id)[1];
        const a = [old[0] - other[0], old[1] - other[1]], b = [now[0] - other[0], now[1] - other[1]];
        this.walk.move(-(now[0] - old[0]) / unit / 2, -(now[1] - old[1]) / unit / 2, 0);
        this.walk.dolly(Math.log(Math.max(1, Math.hypot(...b)) / Math.max(1, Math.hypot(...a))));
        this.walk.roll(Math.atan2(b[1], b[0]) - Math.atan2(a[1], a[0]));
    }

    key(event, down) {
        const key = event.key.toLowerCase();
        if (down && (event.ctrlKey || event.metaKey || event.altKey)) return; // what was held can still be let go
        if (key === 'shift') this.walk[down ? 'hold' : 'release'](key);
        if (down && (key === '+' || key === '-')) this.walk.dolly(key === '+' ? 0.1 : -0.1);
        if (!WALK_KEYS.includes(key)) return;
        event.preventDefault();
        if (down) this.walk.stop();
        this.walk[down ? 'hold' : 'release'](key);
    }
}
