"""What the command-line tests share: the program under test and temporary folders."""
import importlib
import os
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


def need(*modules, also=None):
    """Goes on where these can be imported: in Debian's Python, which may have what another one in PATH lacks. Else the
    test is skipped, as it is for the reason `also`."""
    try:
        for module in modules:
            importlib.import_module(module)
    except ImportError as missing:
        system = "/usr/bin/python3"
        if os.path.exists(system) and not os.path.samefile(system, sys.executable):
            os.execv(system, [system, *sys.argv])
        also = missing
    if also:
        print(f"skipped: {also}")
        sys.exit(77)


class ProgramTest(unittest.TestCase):
    @classmethod
    def shared_folder(cls):
        """An empty one for all tests of the class."""
        holder = tempfile.TemporaryDirectory(prefix="flashsplat-cli-")
        cls.addClassCleanup(holder.cleanup)
        return pathlib.Path(holder.name)

    @staticmethod
    def assert_works(process):
        if process.returncode:
            raise AssertionError(f"{process.args}: {process.returncode}\n{process.stdout}{process.stderr}")
        return process

    def assert_fails(self, process, code, *words):
        """One line on standard error that holds all the words, and the exit code."""
        self.assertEqual(process.returncode, code, process.stderr + process.stdout)
        line = next((l for l in process.stderr.splitlines() if l.startswith("flashsplat: ")), "")
        for word in words:
            self.assertIn(str(word), line, process.stderr)


class FolderTest(ProgramTest):
    """A test with an empty folder of its own, self.dir."""

    def setUp(self):
        holder = tempfile.TemporaryDirectory(prefix="flashsplat-cli-")
        self.addCleanup(holder.cleanup)
        self.dir = pathlib.Path(holder.name)


def main():
    global PROGRAM
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(module="__main__", verbosity=2)
