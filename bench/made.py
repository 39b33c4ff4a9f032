"""What in the folder --out is ours. Its .made.json has, by name, hashes of what each file was given, written before the
file gets its content: a file is ours while its content has one of these, and only then it is replaced. Logs grow, and
are ours by their names. A folder that is emptied has our mark in it. All else is the user's: it is refused, by name,
before anything is done. Nothing is written or removed through a link.
"""
import hashlib, json, os, pathlib, re, shutil, threading

LIST, MARK = ".made.json", "program"
GROWS = "grows"


class NotOurs(OSError):
    pass


def digest(*parts):
    h = hashlib.sha256()
    for part in parts:
        h.update(part if isinstance(part, bytes) else repr(part).encode(errors="surrogatepass"))
    return h.hexdigest()[:16]


def replace(path, content):
    """The whole of a file, or what was there before."""
    part = path.with_name(f".{os.getpid()}-{threading.get_ident()}.part")
    try:
        with open(part, "xb") as f:
            f.write(content)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


class Made:
    """The list of one folder, which is made where there is none."""

    def __init__(self, folder):
        self.folder, self.lock = pathlib.Path(folder), threading.RLock()
        self.folder.mkdir(parents=True, exist_ok=True)
        self.real = self.folder.resolve()
        self.list, self.known = self.real / LIST, {}
        if self.list.is_symlink() or self.list.exists():
            self.known = self.read_list()
        replace(self.list, json.dumps(self.known).encode())  # nothing is begun where nothing can be written

    def read_list(self):
        try:
            known = None if self.list.is_symlink() else json.loads(self.list.read_text())
        except ValueError:
            known = None
        if not isinstance(known, dict) or not all(v == GROWS or isinstance(v, list) for v in known.values()):
            raise NotOurs(f"{self.folder / LIST}: is no list of ours; move it away, or name another --out")
        return known

    def note(self, path, hashes):
        self.known[str(path.relative_to(self.folder))] = hashes
        replace(self.list, json.dumps(self.known).encode())

    def refuse(self, path):
        raise NotOurs(f"{path}: in the way, and not as this program made it; move it away, or name another --out")

    def check_way(self, path):
        """No link on the way to a file, and no file in the place of a folder."""
        real = self.real / path.relative_to(self.folder)
        folder = next(p for p in real.parents if os.path.lexists(p))
        if not folder.is_dir():
            self.refuse(self.folder / folder.relative_to(self.real))
        if real.resolve() != real:
            self.refuse(path)

    def check(self, path):
        """Refuses a file that is not ours."""
        self.check_way(path)
        if not path.exists():
            return
        hashes = self.known.get(str(path.relative_to(self.folder)), [])
        if not path.is_file() or (hashes != GROWS and digest(path.read_bytes()) not in hashes):
            self.refuse(path)

    def write(self, path, content):
        content = content.encode(errors="replace") if isinstance(content, str) else content
        with self.lock:
            self.check(path)
            path.parent.mkdir(parents=True, exist_ok=True)
            before = path.read_bytes() if path.is_file() else None
            if content != before:
                self.note(path, [digest(c) for c in (content, before) if c is not None])
                replace(path, content)

    def take_log(self, path):
        """A file that others append to."""
        with self.lock:
            self.check(path)
            if self.known.get(str(path.relative_to(self.folder))) != GROWS:
                self.note(path, GROWS)

    def mark_of(self, folder):
        """What the mark in a folder of ours says; None where there is none yet."""
        self.check_way(folder)
        if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
            return None
        mark = folder / MARK
        text = mark.read_bytes() if mark.is_file() and not mark.is_symlink() else b""
        if not re.fullmatch(b"[0-9a-f]{16}", text):
            self.refuse(folder)
        return text.decode()

    def empty(self, folder, mark):
        """A folder with nothing in it but the mark, which is there all the time."""
        self.mark_of(folder)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / MARK).write_text(digest("being emptied"))
        for f in folder.iterdir():
            if f.is_dir() and not f.is_symlink():
                shutil.rmtree(f)
            elif f.name != MARK:
                f.unlink()
        (folder / MARK).write_text(mark)
