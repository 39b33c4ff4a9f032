// The photos: a strip to stand where one was taken, and the nearest one beside the scene.
class Film {
    constructor(views, strip, beside) {
        this.views = views;
        this.beside = beside;
        this.buttons = views.map(view => {
            const button = document.createElement('button'), name = document.createElement('span');
            if (view.photo) {
                const image = document.createElement('img');
                image.src = `report/photo_${view.photo}.jpg`;
                image.loading = 'lazy';
                image.alt = '';
                button.append(image);
            }
            name.textContent = view.name + (view.flash ? ' \u26a1' : '');
            button.append(name);
            button.setAttribute('aria-pressed', false);
            strip.append(button);
            return button;
        });
    }

    mark(view) {
        this.buttons.forEach((button, i) => button.setAttribute('aria-pressed', this.views[i] === view));
    }

    // By where it was taken from and where to, of photos that are there; of the same lighting where that is as good.
    nearest(pose, flash) {
        const away = view => length(subtract(view.pose.centre, pose.centre)) / this.spread() +
            2 * (1 - dot(row(view.pose.turn, 2), row(pose.turn, 2))) + (view.flash === flash ? 0 : 0.1);
        const shown = this.views.filter(view => view.photo);
        return shown.length ? shown.reduce((a, b) => away(a) <= away(b) ? a : b) : null;
    }

    spread() {
        const centres = this.views.map(v => v.pose.centre), mean = scale(centres.reduce(add), 1 / centres.length);
        return Math.max(...centres.map(c => length(subtract(c, mean)))) || 1;
    }

    showNearest(pose, flash) {
        const view = this.nearest(pose, flash);
        if (!view || view === this.shown) return;
        this.shown = view;
        this.beside.querySelector('img').src = `report/photo_${view.photo}.jpg`;
        this.beside.querySelector('figcaption').textContent = `Photo ${view.name}${view.flash ? ', with flash' : ''}`;
    }
}
