// Starts the viewer where the page has one: scene.js calls flashsplat.open. What is left of the page works without it.
const viewerRoot = document.getElementById('viewer');
window.flashsplat = {};
if (viewerRoot) window.flashsplat.ready = new Promise((done, failed) => {
    window.flashsplat.open = (scene, text) => {
        try {
            const desk = window.flashsplat.desk = new Desk(viewerRoot);
            desk.open(scene, text).then(done, failed);
        } catch (why) {
            failed(why);
        }
    };
    const script = document.createElement('script');
    script.src = 'report/scene.js';
    script.onload = () => window.flashsplat.desk || failed(new Error('report/scene.js is damaged'));
    script.onerror = () => failed(new Error('report/scene.js is not beside this page'));
    document.head.append(script);
}).catch(why => {
    viewerRoot.querySelector('.status').textContent = `No 3D here: ${why.message}. The pictures below need none.`;
    viewerRoot.querySelector('.panel').hidden = true;
    return why;
});
