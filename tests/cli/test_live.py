"""The page while `run` is at work: it says how far it is and reloads itself, ends as the viewer, says why it stopped,
and is nobody else's file."""
import re
import signal
import subprocess
import time

import common


class Live(common.FolderTest):
    def setUp(self):
        super().setUp()
        self.scene, self.out = self.dir / "scene", self.dir / "out <&>"
        self.assert_works(common.run("synth", "-o", self.scene, "--photos", 12, "--held-out", 0, "--width", 192, "--height", 128,
                                     "--seed", 31, "--threads", 1))

    def words(self, steps):
        return list(map(str, ["run", self.scene / "capture/raw", "-o", self.out, "--poses", self.scene / "truth/sparse",
                              "--long-edge", 64, "--init-count", 200, "--steps", steps, "--progress-every", 20,
                              "--threads", 1]))

    def watch(self, steps, until):
        """Runs until a page fits; every page that was seen."""
        process = subprocess.Popen([common.PROGRAM, *self.words(steps)], stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(lambda: (process.kill(), process.communicate()))
        pages, end = [], time.monotonic() + 200
        while process.poll() is None and time.monotonic() < end and not (pages and until(pages[-1])):
            if (self.out / "index.html").exists():
                text = (self.out / "index.html").read_text()
                if not pages or pages[-1] != text:
                    pages.append(text)
            time.sleep(0.05)
        return process, pages

    def test_a_run_to_its_end(self):
        process, pages = self.watch(60, lambda page: False)
        output, _ = process.communicate(timeout=200)
        self.assertEqual(process.returncode, 0, output)
        self.assertIn("watch it in", output)
        self.assertGreater(len(pages), 0)
        for page in pages:
            self.assertTrue(page.startswith("<!doctype html>") and page.endswith("</html>\n"))  # never half of one
            self.assertIn("<h1>out &lt;&amp;&gt;</h1>", page)
        self.assertIn('http-equiv="refresh"', pages[0])
        self.assertRegex(pages[0], r'aria-current="step">(ingest|poses)<')
        last = (self.out / "index.html").read_text()
        self.assertNotIn('http-equiv="refresh"', last)
        self.assertIn('id="viewer"', last)
        again = self.assert_works(common.run(*self.words(60)))  # all is done: the page stays a viewer
        self.assertNotIn("watch it in", again.stdout)
        said = common.run("info", self.out).stdout
        self.assertIn("layers at the end of training", said)
        self.assertNotIn("--resume", said)

    def test_a_run_that_is_stopped(self):
        process, pages = self.watch(100000, lambda page: "progress/" in page and " s left, l1" in page)
        self.assertRegex(pages[-1], r'aria-current="step">train<')
        self.assertRegex(pages[-1], r'<img src="progress/\d+\.png"')
        self.assertNotIn("left of it", pages[-1])  # training says by itself how long it takes: once
        said = int(re.search(r'<p id="heard" data-at="(\d+)">', pages[-1])[1])
        self.assertLess(abs(said - time.time()), 60)
        picture = re.search(r'src="(progress/\d+\.png)"', pages[-1])[1]
        self.assertTrue((self.out / picture).exists())
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=200)
        self.assertEqual(process.returncode, 130, output)
        page = (self.out / "index.html").read_text()
        self.assertNotIn('http-equiv="refresh"', page)
        self.assertIn("<h2>Stopped</h2>", page)
        self.assertIn("--resume", page)
        said = common.run("info", self.out).stdout
        self.assertIn("the same command with --resume goes on from the checkpoint", said)
        self.assertIn("layers in the course of training", said)

    def test_somebody_elses_page(self):
        self.out.mkdir()
        (self.out / "index.html").write_text("mine")
        process = common.run(*self.words(20))
        self.assert_fails(process, 1, "index.html")
        self.assertEqual((self.out / "index.html").read_text(), "mine")


if __name__ == "__main__":
    common.main()
