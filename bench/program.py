"""Runs the program that is measured, and tells what it took; what its captures hold, as one hash."""
import os, pathlib, subprocess, sys

from made import digest

# Linux counts as a program's memory what the process had that starts it: a small one does, and tells what came of it.
LAUNCHER = """
import os, signal, sys
signal.signal(signal.SIGINT, lambda *_: None)  # the program's to end of
told, program = int(sys.argv[1]), sys.argv[2:]
os.set_inheritable(told, False)
child = os.posix_spawn(program[0], program, os.environ, setsigdef=[signal.SIGPIPE, signal.SIGXFSZ])
_, status, usage = os.wait4(child, 0)
os.write(told, b"%d %d %f" % (os.waitstatus_to_exitcode(status), usage.ru_maxrss, usage.ru_utime + usage.ru_stime))
"""


class Failed(Exception):
    pass


def launch(args, log):
    """Exit status, most kB of memory and CPU seconds of a program that says all into an open file."""
    told, tell = os.pipe()
    with open(told, "rb") as answer:
        try:
            process = subprocess.Popen([sys.executable, "-I", "-S", "-c", LAUNCHER, str(tell), *args], stdout=log, stderr=log,
                                       pass_fds=[tell])
        finally:
            os.close(tell)
        words = answer.read().split()
    rc = process.wait()
    return (int(words[0]), int(words[1]), float(words[2])) if words else (rc or 1, 0, 0.0)


def complaint(text):
    """The line that says what failed."""
    lines = text.strip().splitlines()
    return next((l for l in reversed(lines) if l.startswith("flashsplat:")), lines[-1] if lines else "")


def call(args, log, most=None):
    """Runs the program, all it says into a file; its warnings are returned. most: the most "bytes" of memory it had, and
    the "cpu_seconds" of all such calls, which other programs beside it hardly change."""
    args = [str(a) for a in args]
    with open(log, "ab") as f:
        begin = f.seek(0, os.SEEK_END)
        rc, kilobytes, seconds = launch(args, f)
    if most is not None:
        most["bytes"] = max(most.get("bytes", 0), 1024 * kilobytes)
        most["cpu_seconds"] = most.get("cpu_seconds", 0) + seconds
    text = pathlib.Path(log).read_bytes()[begin:].decode(errors="replace")
    if rc:
        raise Failed(f"{' '.join(args[:3])}: {complaint(text) or rc}")
    return [line.strip() for line in text.splitlines() if "warning" in line.lower()]


HASHES = {}  # of files that were read before, while their times and sizes stay


def hash_of(path):
    s = path.stat()
    key = (str(path), s.st_size, s.st_mtime_ns, s.st_ctime_ns, s.st_ino)
    if key not in HASHES:
        HASHES[key] = digest(path.read_bytes())
    return HASHES[key]


def content(*folders):
    """Of all files below them, hidden ones left out: names and what they hold."""
    found = []
    for number, folder in enumerate(folders):
        names = sorted(p.relative_to(folder) for p in folder.rglob("*") if p.is_file())
        found += [(number, str(n), hash_of(folder / n)) for n in names if not any(part.startswith(".") for part in n.parts)]
    return digest(found)
