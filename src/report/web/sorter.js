// Farthest first, in a thread of its own. Keys are the upper bits of a depth's float (positive ones are in order as
// whole numbers are): 17 bits of mantissa, which no eye tells from exact, in two passes of 11 bits.
function sorterThread() {
    const clouds = [], bits = new Uint32Array(1), float = new Float32Array(bits.buffer);
    const count = new Uint32Array(2048);

    function pass(keys, from, to, n, shift) {
        count.fill(0);
        for (let i = 0; i < n; i++) count[keys[from[i]] >>> shift & 2047]++;
        for (let k = 2047, at = 0; k >= 0; k--) { // falling
            const here = count[k];
            count[k] = at;
            at += here;
        }
        for (let i = 0; i < n; i++) to[count[keys[from[i]] >>> shift & 2047]++] = from[i];
    }

    function sort(cloud, [a, b, c, d], near) {
        const { place, keys, first, second } = cloud, order = new Uint32Array(place.length / 3);
        float[0] = near;
        const nearest = bits[0] >>> 6, most = 2 ** 22 - 1;
        let n = 0;
        for (let i = 0; i < order.length; i++) {
            const z = a * place[3 * i] + b * place[3 * i + 1] + c * place[3 * i + 2] + d;
            if (!(z >= near)) continue;
            float[0] = z;
            keys[i] = Math.min((bits[0] >>> 6) - nearest, most);
            first[n++] = i;
        }
        pass(keys, first, second, n, 0);
        pass(keys, second, order, n, 11);
        return { order, n };
    }

    onmessage = ({ data }) => {
        if (data.place) {
            const n = data.place.length / 3;
            clouds.push({ place: data.place, keys: new Uint32Array(n), first: new Uint32Array(n),
                          second: new Uint32Array(n) });
            return;
        }
        const sorted = clouds.map(cloud => sort(cloud, data.row, data.near));
        postMessage({ stamp: data.stamp, sorted }, sorted.map(s => s.order.buffer));
    };
}

// One request under way, the latest one waits.
class Sorter {
    constructor(clouds, near, done) {
        const text = `(${sorterThread})()`;
        this.thread = new Worker(URL.createObjectURL(new Blob([text], { type: 'text/javascript' })));
        this.thread.onmessage = ({ data }) => {
            this.busy = false;
            done(data);
            if (this.waiting) this.send(this.waiting);
        };
        for (const { n, data } of clouds) {
            const place = new Float32Array(3 * n);
            for (let i = 0; i < n; i++) place.set(data.subarray(FLOATS * i, FLOATS * i + 3), 3 * i);
            this.thread.postMessage({ place }, [place.buffer]);
        }
        this.near = near;
    }

    // pose: { turn, centre }; stamp comes back with the order.
    ask(pose, stamp) {
        const forward = row(pose.turn, 2);
        const request = { row: [...forward, -dot(forward, pose.centre)], near: this.near, stamp };
        if (this.busy) this.waiting = request;
        else this.send(request);
    }

    send(request) {
        this.busy = true;
        this.waiting = null;
        this.thread.postMessage(request);
    }
}
