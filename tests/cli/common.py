"""What the command-line tests share: the program under test and temporary folders."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = None  # set by main()


def run(*arguments, timeout=120, **options):
    """Runs flashsplat, returns the finished process with text output."""
    return subprocess.run([PROGRAM, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, timeout=timeout, check=False, **options)


class FolderTest(unittest.TestCase):
    """A test with an empty folder of its own, self.dir."""

    def setUp(self):
        holder = tempfile.TemporaryDirectory(prefix="flashsplat-cli-")
        self.addCleanup(holder.cleanup)
        self.dir = pathlib.Path(holder.name)

    def assert_fails(self, process, code, *words):
        """One line on standard error that holds all the words, and the exit code."""
        self.assertEqual(process.returncode, code, process.stderr + process.stdout)
        line = next((l for l in process.stderr.splitlines() if l.startswith("flashsplat: ")), "")
        for word in words:
            self.assertIn(str(word), line, process.stderr)


def main():
    global PROGRAM
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(module="__main__", verbosity=2)
