"""`flashsplat view`: says where the page is or opens it, and serves it to this machine and nobody else."""
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import time

import common

BARE = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}


class View(common.FolderTest):
    def setUp(self):
        super().setUp()
        self.out = self.dir / "out"
        (self.out / "report").mkdir(parents=True)
        (self.out / "clouds").mkdir()
        (self.out / "index.html").write_text("<!doctype html>page")
        (self.out / "report/scene.js").write_text("x" * 300000)
        (self.out / "report/.hidden").write_text("secret")
        (self.out / "clouds/T_N.ply").write_text("ply")
        (self.out / "linear").mkdir()
        (self.out / "linear/a.tif").write_text("secret")
        (self.out / "export/photos").mkdir(parents=True)
        (self.out / "export/photos/Glas groß 1.jpg").write_text("photo")
        (self.out / "export/photos/out").symlink_to(self.dir)
        (self.out / "views.json").write_text("{}")
        (self.dir / "outside.txt").write_text("secret")
        (self.out / "report/link.js").symlink_to(self.dir / "outside.txt")
        (self.out / "video").symlink_to(self.out / "clouds")
        os.mkfifo(self.out / "report/pipe.js")

    def test_without_a_display_it_names_the_page(self):
        process = self.assert_works(common.run("view", self.out, env=BARE))
        self.assertEqual(process.stdout, f"{self.out.resolve()}/index.html\n")
        self.assert_fails(common.run("view", self.dir), 1, "index.html", "flashsplat run")
        self.assertEqual(common.run("view").returncode, 2)

    def test_with_a_display_it_opens_the_page(self):
        tools = self.dir / "tools"
        tools.mkdir()
        (tools / "xdg-open").write_text(f'#!/bin/sh\necho "$1" >{self.dir}/opened\n')
        (tools / "xdg-open").chmod(0o755)
        path = f"{tools}:{os.environ['PATH']}"
        self.assert_works(common.run("view", self.out, env={**BARE, "DISPLAY": ":9", "PATH": path}))
        self.assertEqual((self.dir / "opened").read_text(), f"{self.out.resolve()}/index.html\n")
        (tools / "xdg-open").write_text("#!/bin/sh\nexit 3\n")
        process = self.assert_works(common.run("view", self.out, env={**BARE, "WAYLAND_DISPLAY": "w", "PATH": path}))
        self.assertIn("warning: xdg-open", process.stderr)

    def a_browser_that_stays(self):
        """What xdg-open does where no browser is open yet, and no desktop to ask: it is the browser until that ends."""
        tools = self.dir / "tools"
        tools.mkdir()
        (tools / "xdg-open").write_text(f'#!/bin/sh\necho $$ >{self.dir}/browser\nexec sleep 100\n')
        (tools / "xdg-open").chmod(0o755)
        self.addCleanup(lambda: os.kill(int((self.dir / "browser").read_text()), signal.SIGKILL))
        return {**BARE, "DISPLAY": ":9", "PATH": f"{tools}:{os.environ['PATH']}"}

    def test_a_browser_that_stays_holds_nothing_up(self):
        env = self.a_browser_that_stays()
        begin = time.monotonic()
        process, port = self.serve(env)
        self.assertEqual(self.get(port, "/")[0], 200)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(20), 0)
        os.kill(int((self.dir / "browser").read_text()), 0)  # Ctrl-C is not for it
        os.kill(int((self.dir / "browser").read_text()), signal.SIGKILL)
        self.assert_works(common.run("view", self.out, env=env))
        self.assertLess(time.monotonic() - begin, 60)

    def serve(self, env=BARE):
        process = subprocess.Popen([common.PROGRAM, "view", str(self.out), "--serve", "--port", "0"], env=env,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(lambda: (process.kill(), process.communicate()))
        port = int(re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\n", process.stdout.readline())[1])
        return process, port

    @staticmethod
    def ask(port, request):
        with socket.create_connection(("127.0.0.1", port), timeout=20) as s:
            s.sendall(request)
            answer = b""
            while part := s.recv(1 << 16):
                answer += part
        head, _, body = answer.partition(b"\r\n\r\n")
        return int(head.split()[1]), head.decode(), body

    def get(self, port, path, host="127.0.0.1", method="GET"):
        return self.ask(port, f"{method} {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())

    def test_serves_the_page_and_nothing_else(self):
        process, port = self.serve()
        for path in ("/", "/index.html", "/?a=b"):
            code, head, body = self.get(port, path)
            self.assertEqual((code, body), (200, b"<!doctype html>page"))
            self.assertIn("Content-Type: text/html; charset=utf-8", head)
            self.assertIn("Cross-Origin-Resource-Policy: same-origin", head)  # no other page may take the scene
        self.assertEqual(self.get(port, "/report/scene.js")[::2], (200, b"x" * 300000))
        code, head, body = self.get(port, "/report/scene.js", method="HEAD")
        self.assertEqual((code, body), (200, b""))
        self.assertIn("Content-Length: 300000", head)
        for path, body in (("/clouds/T_N.ply", b"ply"), ("/views.json", b"{}"),
                           ("/export/photos/Glas%20gro%C3%9f%201.jpg", b"photo")):
            self.assertEqual(self.get(port, path)[::2], (200, body), path)
        for path in ("/linear/a.tif", "/clouds", "/export/photos", "/export/photos/", "/export/photos/out/outside.txt",
                     "/export/photos%2fa.jpg", "/clouds/%2e%2e/views.json", "/clouds/..", "/clouds/%00T_N.ply",
                     "/clouds/%", "/done/train.json", "/report/.hidden", "/report/link.js", "/report/pipe.js", "/video/T_N.ply",
                     "/report", "/report/", "//index.html", "/report//scene.js", "/../outside.txt",
                     "/report/../index.html",
                     "/report/..%2f..%2foutside.txt", "/%2e%2e/outside.txt", "/report/../../outside.txt", "index.html",
                     str(self.dir / "outside.txt"), "http://127.0.0.1/index.html", "/.flashsplat/made"):
            code, _, body = self.get(port, path)
            self.assertEqual((code, body), (404, b""), path)
        self.assertEqual(self.get(port, "/", host=f"localhost:{port}")[0], 200)
        for host in ("evil.example", "127.0.0.1.evil.example", "", "127.0.0.2"):
            self.assertEqual(self.get(port, "/", host=host)[0], 403, host)
        self.assertEqual(self.ask(port, b"GET / HTTP/1.1\r\n\r\n")[0], 403)
        self.assertEqual(self.get(port, "/", method="POST")[0], 405)
        for line in (b"nonsense", b"GET /", b"GET / HTTP/2.0", b"GET / gopher", b"GET /" + b"a" * 1023 + b" HTTP/1.1"):
            self.assertEqual(self.ask(port, line + b"\r\nHost: localhost\r\n\r\n")[0], 400, line)
        self.assertEqual(self.ask(port, b"GET /" + b"a" * 8186)[0], 431)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(20), 0)

    def test_ranges(self):
        """As browsers ask for films."""
        (self.out / "report/film.mp4").write_bytes(bytes(range(200)))
        _, port = self.serve()

        def ask(value, path="/report/film.mp4"):
            return self.ask(port, f"GET {path} HTTP/1.1\r\nHost: localhost\r\nRange: {value}\r\n\r\n".encode())

        for value, first, end in (("bytes=0-", 0, 200), ("bytes=5-9", 5, 10), ("bytes=190-400", 190, 200),
                                  ("bytes=-7", 193, 200), ("bytes=-900", 0, 200)):
            code, head, body = ask(value)
            self.assertEqual((code, body), (206, bytes(range(first, end))), value)
            self.assertIn(f"Content-Range: bytes {first}-{end - 1}/200\r\n", head + "\r\n")
        code, head, body = ask("bytes=200-")
        self.assertEqual((code, body), (416, b""))
        self.assertIn("Content-Range: bytes */200", head)
        for value in ("bytes=9-5", "bytes=", "bytes=-", "bytes=a-b", "bytes=0-1,5-6", "lines=0-1", "bytes=5-9x"):
            self.assertEqual(ask(value)[::2], (200, bytes(range(200))), value)
        self.assertEqual(ask("bytes=0-1", "/report/none.mp4")[0], 404)

    def test_out_of_files(self):
        """Where the system gives no more, it waits and does not spin; then it goes on."""
        process, port = self.serve()
        resource.prlimit(process.pid, resource.RLIMIT_NOFILE, (34, 64))
        waiting = [socket.create_connection(("127.0.0.1", port)) for _ in range(32)]
        time.sleep(0.3)
        before = self.seconds(process.pid)
        time.sleep(1.5)
        self.assertLess(self.seconds(process.pid) - before, 0.4)
        resource.prlimit(process.pid, resource.RLIMIT_NOFILE, (64, 64))
        for s in waiting:
            s.close()
        time.sleep(0.5)
        self.assertEqual(self.get(port, "/")[0], 200)

    @staticmethod
    def seconds(pid):
        fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def test_is_not_held_up(self):
        """By clients that say nothing, and more of them than it takes."""
        process, port = self.serve()
        idle = [socket.create_connection(("127.0.0.1", port)) for _ in range(20)]
        self.assertEqual(self.get(port, "/")[0], 200)
        idle += [socket.create_connection(("127.0.0.1", port)) for _ in range(40)]
        time.sleep(0.5)
        self.assertIsNone(process.poll())
        for s in idle:
            s.close()
        time.sleep(0.5)
        self.assertEqual(self.get(port, "/")[0], 200)

    def test_is_for_this_machine_only(self):
        _, port = self.serve()
        listening = [line.split() for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]]
        at = [l[1] for l in listening if l[3] == "0A" and l[1].endswith(f":{port:04X}")]
        self.assertEqual(at, [f"0100007F:{port:04X}"])
        everywhere = pathlib.Path("/proc/net/tcp6")
        if everywhere.exists():
            self.assertNotRegex(everywhere.read_text(), rf":{port:04X} 0+:0000 0A")

    def test_a_port_that_is_taken(self):
        _, port = self.serve()
        self.assert_fails(common.run("view", self.out, "--serve", "--port", port, env=BARE), 1, port, "--port")


if __name__ == "__main__":
    common.main()
