"""Memory that runs out, kill -9 and full disks: a tiny job ends with the very results of an undisturbed one, or with a
reason; never with others, a signal or a hang. A sample by default; FLASHSPLAT_FAULTS=full in the environment runs the
whole campaign (300 allocations, 100 kills, 20 disks), FLASHSPLAT_FAULTS_SEED chooses another."""
import collections
import concurrent.futures
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PRELOAD = str(pathlib.Path(sys.argv.pop(2)).resolve())
PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
FULL = os.environ.get("FLASHSPLAT_FAULTS") == "full"
RANDOM = random.Random(int(os.environ.get("FLASHSPLAT_FAULTS_SEED", "1")))
TRAIN = ["--steps", "8", "--max-splats", "400", "--progress-every", "4", "--checkpoint-every", "3"]
TIMEOUT = 300  # seconds: a hang
# What may differ between two runs: times, and what is kept to go on from.
UNLIKE = ("/checkpoint", "/done/", "/colmap/", "/.flashsplat/", ".part")
TIMES = {"index.html": rb"in <b>\d+</b> \w+", "log.jsonl": rb'"seconds": [\d.]+, '}
# Results outside of our folders, which are not overwritten.
OUTSIDE = ("pair.png", "pair.tif", "evaluate.json")
# Where a library does not survive it: while libtiff 4.5 reads tags, it uses tables of them that it could not make larger;
# the film libraries write into memory that they did not get (x264's headers, libavformat's trailer) or assert that they
# got it (libavcodec's defaults), or make another film in silence (libavformat's trailer without the user data, x264's
# weighted prediction); LibRaw's constructor does not look whether it got its list of memory.
IN_LIBRARIES = ("_ZN6LibRawC1Ej", "TIFFReadDirectory", "libx264.so", "libavcodec.so", "libavformat.so")
GOOD = ("same", "reason", "library")
ENVIRONMENT = {k: v for k, v in os.environ.items() if not k.startswith(("ASAN_", "LD_PRELOAD"))}


def run(words, cwd, **variables):
    return subprocess.run([PROGRAM, *map(str, words)], cwd=cwd, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, errors="replace", timeout=TIMEOUT, check=False,
                          env={**ENVIRONMENT, **{k: str(v) for k, v in variables.items()}})


def snapshot(folder):
    """The bytes of every result under a folder; of the page and the log without the time that training took."""
    files = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_file() and not any(part in "/" + name for part in UNLIKE):
            data = path.read_bytes()
            files[name] = re.sub(TIMES[path.name], b"", data) if path.name in TIMES else data
    return files


def difference(folder, wanted):
    """What is not as wanted in a folder, in words; empty when all is."""
    found = snapshot(folder)
    names = sorted(n for n in found.keys() | wanted.keys() if found.get(n) != wanted.get(n))
    kind = {n: "missing" if n not in found else "too many" if n not in wanted else "differs" for n in names}
    return ", ".join(f"{n} {kind[n]}" for n in names[:8])


def disk_use(folder):
    return sum(4096 * (2 + (p.stat().st_size + 4095) // 4096 if p.is_file() else 2) for p in folder.rglob("*"))


def unfinished(name):
    """COLMAP's own files, and what a person reads of a run that is not over."""
    return ".part" in name or "/colmap/" in name or "/warnings/" in name or name.endswith("index.html")


class Faults(unittest.TestCase):
    """self.jobs: command lines, each run in a copy of self.before[job], which leave self.after[job] there."""

    @classmethod
    def setUpClass(cls):
        shm = pathlib.Path("/dev/shm")  # where there is one, syncing costs nothing
        holder = tempfile.TemporaryDirectory(prefix="flashsplat-faults-",
                                             dir=shm if shm.is_dir() and os.access(shm, os.W_OK) else None)
        cls.addClassCleanup(holder.cleanup)
        cls.dir = pathlib.Path(holder.name)
        scene = cls.dir / "scene"
        synth = ["synth", "-o", "scene", "--photos", 6, "--held-out", 1, "--width", 160, "--height", 112, "--seed", 3]
        cls.ok(synth, cls.dir)
        known = ["--poses", scene / "truth/sparse", "--long-edge", 48, "--init-count", 100]
        cls.jobs = {
            "run": ["run", scene / "capture/raw", "-o", "out", *known, *TRAIN, "--threads", 1],
            "kill": ["run", scene / "capture/raw", "-o", "out", *known, *TRAIN[:-1], 1, "--resume", "--threads", 1],
            "resume": ["train", "out", *TRAIN, "--resume", "--threads", 1],
            "film": ["render", "out", "-o", "film", "--path", "spiral", "--path-views", 3, "--video", "--linear",
                     "--threads", 1],
            "views": ["render", "out", "-o", "views", "--cameras", scene / "truth/sparse", "--threads", 1],
            "evaluate": ["evaluate", "out", scene / "truth", "--output", "views", "--json", "evaluate.json",
                         "--threads", 1],
            "synth": ["synth", "-o", "scene", "--photos", 2, "--held-out", 1, "--width", 32, "--height", 32,
                      "--threads", 1],
            "pair": ["pair", scene / "capture/jpeg/IMG_0001.JPG", scene / "capture/jpeg/IMG_0002.JPG", "-o",
                     "pair.png", "--linear"],
            "info": ["info", "out"],
        }
        cls.before, cls.after, cls.stdout = {}, {}, {}
        for job in cls.jobs:
            cls.before[job] = cls.dir / "before" / job
            cls.before[job].mkdir(parents=True)
            if job == "resume":
                cls.half_trained(cls.before[job])
            elif job not in ("run", "kill", "synth", "pair"):
                shutil.copytree(cls.dir / "after/run/out", cls.before[job] / "out")
            if job == "evaluate":
                shutil.copytree(cls.dir / "after/views/views", cls.before[job] / "views")
            work = cls.dir / "after" / job
            shutil.copytree(cls.before[job], work)
            cls.stdout[job] = cls.ok(cls.jobs[job], work)
            cls.after[job] = snapshot(work)
        cls.pool = concurrent.futures.ThreadPoolExecutor(2)

    @classmethod
    def ok(cls, words, cwd):
        process = run(words, cwd)
        if process.returncode != 0:
            raise AssertionError(f"{words}: {process.returncode}\n{process.stdout}\n{process.stderr}")
        return process.stdout

    @classmethod
    def half_trained(cls, folder):
        """A project whose training was ended after its first checkpoint."""
        shutil.copytree(cls.dir / "after/run/out", folder / "out")
        for name in ("done/train.json", "done/render.json", "done/export.json"):
            (folder / "out" / name).unlink()

    def reason(self, process):
        """None when a failed program said why, else what is wrong with how it ended."""
        if process.returncode not in (1, 2):
            return f"exit status {process.returncode}"
        line = next((l for l in process.stderr.splitlines() if l.startswith("flashsplat: ")), "")
        return None if len(line) > len("flashsplat: ") + 8 else "no reason"

    def watch(self, one, *task):
        """The outcome of one run: (name, 'same', 'reason', 'library' or what went wrong)."""
        try:
            name, outcome = one(*task)
        except subprocess.TimeoutExpired as hang:
            name, outcome = f"{task}", f"hangs: {hang}"
        if outcome not in GOOD:  # now: the whole campaign takes long
            print(f"{name}: {outcome}", file=sys.stderr, flush=True)
        return name, outcome

    def report(self, what, outcomes):
        """One line of counts, then fails on what went wrong."""
        outcomes = list(outcomes)
        counts = collections.Counter(o if o in GOOD else "wrong" for _, o in outcomes)
        print(f"{what}: {len(outcomes)} run, {counts['same']} with the same results, {counts['reason']} with a reason, "
              f"{counts['library']} lost in a library, {counts['wrong']} wrong", file=sys.stderr)
        wrong = [f"{name}: {o}" for name, o in outcomes if o not in GOOD]
        self.assertFalse(wrong, "\n" + "\n".join(wrong))

    # ---- memory ----

    def stacks(self, job):
        """The first allocation of every call stack in a job."""
        with tempfile.TemporaryDirectory(dir=self.dir) as folder:
            work = shutil.copytree(self.before[job], pathlib.Path(folder) / "work")
            run(self.jobs[job], work, LD_PRELOAD=PRELOAD, FAULT_RECORD=folder + "/stacks")
            return [int(n) for n in (pathlib.Path(folder) / "stacks").read_text().split()]

    def fail_allocation(self, job, n, all_after):
        with tempfile.TemporaryDirectory(dir=self.dir) as folder:
            work = shutil.copytree(self.before[job], pathlib.Path(folder) / "work")
            more = {"FAULT_FROM": 1} if all_after else {}
            trace = pathlib.Path(folder) / "trace"
            name = f"{job}, allocation {n}{' and all after' if all_after else ''}"
            process = run(self.jobs[job], work, LD_PRELOAD=PRELOAD, FAULT_AT=n, FAULT_TRACE=trace, **more)
            outcome = "same"
            if process.returncode == 0:
                bad = difference(work, self.after[job])
                if job in ("info", "evaluate") and process.stdout != self.stdout[job]:
                    bad += " printed text differs"
                if bad:
                    outcome = f"exit status 0, but {bad}"
            else:
                outcome = self.reason(process) or "reason"
                if outcome == "reason" and job != "info":  # with memory again, the command finishes what is left
                    for name_ in OUTSIDE:
                        (work / name_).unlink(missing_ok=True)
                    again = run(self.jobs[job], work)
                    bad = difference(work, self.after[job]) if again.returncode == 0 else again.stderr
                    outcome = f"done again: {bad}" if bad else outcome
            where = trace.read_text() if trace.exists() else ""
            died = process.returncode < 0 or re.fullmatch(r"exit status 0, but (\S+\.mp4 differs(, )?)+", outcome)
            if died and any(name in where for name in IN_LIBRARIES):
                return name, "library"
            if outcome not in ("same", "reason"):
                outcome += f"\n{process.stderr}{where}"
            return name, outcome

    def test_memory(self):
        share = {"run": 22, "resume": 4, "film": 4, "views": 2, "evaluate": 4, "synth": 1, "pair": 2, "info": 1}
        tasks = []
        for job, n in share.items():
            n = 8 * n if FULL else n
            stacks = self.stacks(job)  # in their order: one out of each nth part of the job
            for i in range(n):
                tasks.append((job, stacks[int((i + RANDOM.random()) * len(stacks) / n)], i % 4 == 3))
        self.report("failed allocations", self.pool.map(lambda t: self.watch(self.fail_allocation, *t), tasks))

    # ---- kill -9 ----

    def kill_thrice(self, name):
        """Three kills, each in a run that goes on from the last, at moments spread over the time the whole takes."""
        moments = sorted(RANDOM.random() for _ in range(3))
        with tempfile.TemporaryDirectory(dir=self.dir) as folder:
            work = pathlib.Path(folder)
            killed = 0
            for before, moment in zip([0, *moments], moments):
                process = subprocess.Popen([PROGRAM, *map(str, self.jobs["kill"])], cwd=work, stdin=subprocess.DEVNULL,
                                           stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=ENVIRONMENT,
                                           start_new_session=True)
                try:
                    process.communicate(timeout=(moment - before) * self.seconds)
                except subprocess.TimeoutExpired:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.communicate()
                    killed += 1
            Faults.kills += killed
            last = run(self.jobs["kill"], work)
            if last.returncode != 0:
                return name, f"exit status {last.returncode} of the last run: {last.stderr}"
            bad = difference(work, self.after["kill"])
            return name, bad or "same"

    def test_kill(self):
        Faults.kills, outcomes = 0, []
        wanted = 100 if FULL else 6
        while len(outcomes) < wanted or self.kills < wanted:
            if len(outcomes) % 10 == 0:  # the machine may have other work at times
                start = time.monotonic()
                with tempfile.TemporaryDirectory(dir=self.dir) as folder:
                    self.ok(self.jobs["kill"], folder)
                self.seconds = time.monotonic() - start
            outcomes.append(self.watch(self.kill_thrice, f"kill {len(outcomes)}"))
        print(f"{self.kills} kills", file=sys.stderr)
        self.report("runs killed three times", outcomes)

    # ---- full disks ----

    # $1: bytes, $2: what the disk holds at first, $3: the mount point, $4: where the outcome goes; then the program.
    DISK = '''
mount -t tmpfs -o size=$1 none "$3" || exit 99
cp -r "$2"/. "$3" || exit 98
cd "$3" && results=$4 program=$5 && shift 5
"$program" "$@" >"$results/out" 2>"$results/err"
echo $? >"$results/first"
cp -r . "$results/at-once"
mount -o remount,size=1g "$PWD" || exit 97
rm -f pair.png pair.tif evaluate.json
"$program" "$@" >"$results/out2" 2>"$results/err2"
echo $? >"$results/second"
cp -r . "$results/after"
'''

    def fill_disk(self, job, size):
        name = f"{job} on a disk of {size} bytes"
        with tempfile.TemporaryDirectory(dir=self.dir) as folder:
            work = pathlib.Path(folder)
            for part in ("disk", "results"):
                (work / part).mkdir()
            subprocess.run(["unshare", "-rm", "sh", "-c", self.DISK, "sh", str(size), self.before[job], work / "disk",
                            work / "results", PROGRAM, *map(str, self.jobs[job])], check=True, timeout=TIMEOUT,
                           env=ENVIRONMENT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            results = work / "results"
            first, second = (int((results / n).read_text()) for n in ("first", "second"))
            stderr = (results / "err").read_text()
            if first == 0:
                bad = difference(results / "at-once", self.after[job])
                return name, f"exit status 0, but {bad}" if bad else "same"
            last = stderr.splitlines()[-1] if stderr else ""
            if first != 1 or not last.startswith("flashsplat: ") or "No space left on device" not in last:
                return name, f"exit status {first}: {stderr}"
            if second != 0:
                return name, f"with room again: exit status {second}: {(results / 'err2').read_text()}"
            bad = difference(results / "after", self.after[job])
            if bad:
                return name, f"with room again: {bad}"
            torn = [n for n, data in snapshot(results / "at-once").items()
                    if data != self.after[job].get(n) and data != self.first[job].get(n) and not unfinished(n)]
            return name, f"torn: {torn}" if torn else "reason"

    def test_full_disk(self):
        if subprocess.run(["unshare", "-rm", "sh", "-c", "mount -t tmpfs none /mnt"], check=False,
                          capture_output=True).returncode != 0:
            self.skipTest("no tmpfs of its own may be mounted here")
        Faults.first = {job: snapshot(self.before[job]) for job in self.jobs}
        share = {"run": 10, "resume": 2, "film": 3, "synth": 3, "pair": 2} if FULL else \
                {"run": 3, "film": 1, "synth": 1, "pair": 1}
        tasks = []
        for job, n in share.items():
            used, whole = disk_use(self.before[job]), disk_use(self.dir / "after" / job)
            tasks += [(job, used + int((whole - used) * (i + RANDOM.random()) / n) // 4096 * 4096) for i in range(n)]
        self.report("full disks", self.pool.map(lambda t: self.watch(self.fill_disk, *t), tasks))


unittest.main(module="__main__", verbosity=2)
