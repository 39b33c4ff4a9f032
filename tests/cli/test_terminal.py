"""What a person sees: a bar on a terminal, plain lines elsewhere, nothing with --quiet."""
import fcntl
import os
import pty
import struct
import subprocess
import termios

import common
import pictures
from common import FolderTest, run

FLASH = ["--flash-glob", "F_*"]


class Terminal(FolderTest):
    def setUp(self):
        super().setUp()
        self.photos = pictures.photos(self.dir / "photos", 4)
        self.words = ["ingest", self.photos, "-o", self.dir / "out", *FLASH]

    def on_terminal(self, *words, columns=0, **environment):
        """The exit code, standard output, and what a terminal as standard error gets."""
        ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        process = subprocess.Popen([common.PROGRAM, *map(str, words)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=theirs, env={**os.environ, "TERM": "xterm", **environment})
        os.close(theirs)
        shown = b""
        while True:
            try:
                block = os.read(ours, 4096)
            except OSError: # the other side is closed
                break
            if not block:
                break
            shown += block
        os.close(ours)
        return process.wait(timeout=60), process.communicate()[0].decode(), shown.decode()

    def test_bar(self):
        code, output, shown = self.on_terminal(*self.words)
        self.assertEqual(code, 0)
        self.assertRegex(shown, r"\ringest +\[[#.]{24}\] +\d+% \d/8 ")
        self.assertRegex(shown, r"8/8 [^\n]*\r\x1b\[Kwarning: ") # the bar gives way to a line
        self.assertRegex(shown[shown.rindex("8/8"):], r"\r\x1b\[K") # and is wiped in the end
        self.assertNotIn("\r", output)
        for line in shown.split("\r"):
            self.assertLess(len(line.replace("\x1b[K", "").strip("\n")), 200)

    def test_narrow_terminal(self):
        _, _, shown = self.on_terminal(*self.words, columns=12)
        bars = [part.split("\x1b[K")[0] for part in shown.split("\r") if part.startswith("ingest")]
        self.assertGreater(len(bars), 1)
        self.assertEqual(max(map(len, bars)), 11)

    def test_dumb_terminal(self):
        _, _, shown = self.on_terminal(*self.words, TERM="dumb")
        self.assertNotIn("\x1b", shown)
        self.assertIn("ingest: 8/8", shown)

    def test_lines(self):
        process = run(*self.words)
        self.assertNotIn("\r", process.stderr + process.stdout)
        self.assertNotIn("\x1b", process.stderr + process.stdout)
        self.assertIn("ingest: 8/8", process.stderr)
        self.assertIn("4 with flash", process.stdout)

    def test_quiet(self):
        process = self.assert_works(run(*self.words, "--quiet"))
        self.assertEqual(process.stdout, "")
        for line in process.stderr.splitlines():
            self.assertTrue(line.startswith("warning: "), line)
        self.assertIn("project folder", run("info", self.dir / "out", "-q").stdout)

    def test_skipped(self):
        run(*self.words)
        process = run(*self.words)
        self.assertIn("ingest: done already, skipped", process.stdout)
        process = run(*self.words, "--long-edge", 20)
        self.assertIn("the setting long-edge was 1200 and is 20 now", process.stdout)

    def test_output_that_cannot_be_written(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            process = subprocess.run([common.PROGRAM, "--version"], stdout=full, check=False)
            self.assertEqual(process.returncode, 1)
            process = subprocess.run([common.PROGRAM, "run", "--help"], stdout=full, stderr=subprocess.PIPE,
                                     check=False)
            self.assertEqual(process.returncode, 1)


common.main()
