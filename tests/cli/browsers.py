"""Chromium and Firefox, driven from here over a WebSocket: Chromium by its DevTools protocol, Firefox
by WebDriver BiDi. Both draw with software where there is no graphics card. No package beyond the browsers is needed."""
import base64
import json
import os
import pathlib
import re
import shutil
import socket
import struct
import subprocess
import tempfile
import time

START = 60  # seconds
CALL = 100


class Socket:
    """A client's WebSocket for text messages (RFC 6455)."""

    def __init__(self, url):
        host, port, path = re.match(r"ws://([^:/]+):(\d+)(/.*)", url).groups()
        self.socket = socket.create_connection((host, int(port)), timeout=CALL)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade"
                            f"\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        self.data = b""
        while b"\r\n\r\n" not in self.data:
            self.fill()
        head, self.data = self.data.split(b"\r\n\r\n", 1)
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise OSError(head.decode(errors="replace"))

    def fill(self):
        data = self.socket.recv(1 << 20)
        if not data:
            raise OSError("the browser hung up")
        self.data += data

    def take(self, n):
        while len(self.data) < n:
            self.fill()
        taken, self.data = self.data[:n], self.data[n:]
        return taken

    def send(self, text, opcode=1):
        data, mask = text.encode(), os.urandom(4)
        n = len(data)
        size = struct.pack(">B", 128 | n) if n < 126 else struct.pack(">BH", 254, n) if n < 65536 else \
            struct.pack(">BQ", 255, n)
        masked = bytes(b ^ mask[i % 4] for i, b in enumerate(data))
        self.socket.sendall(bytes([128 | opcode]) + size + mask + masked)

    def receive(self):
        text = b""
        while True:
            first, second = self.take(2)
            n = second & 127
            n = struct.unpack(">H", self.take(2))[0] if n == 126 else struct.unpack(">Q", self.take(8))[0] if n == 127 \
                else n
            payload, opcode = self.take(n), first & 15
            if opcode == 9:
                self.send(payload.decode(), 10)
            elif opcode == 8:
                raise OSError("the browser closed the connection")
            elif opcode < 3:
                text += payload
                if first & 128:
                    return text.decode()


class Browser:
    """One page. errors: what it wrote to its console as an error or a warning, and failed scripts."""

    def __init__(self, program, flags, announces):
        self.errors, self.number = [], 0
        self.profile = tempfile.TemporaryDirectory(prefix="flashsplat-browser-", ignore_cleanup_errors=True)
        log = pathlib.Path(self.profile.name) / "log"
        log.with_name("user.js").write_text("".join(f"user_pref({json.dumps(k)}, {json.dumps(v)});\n"
                                                    for k, v in self.preferences.items()))
        with open(log, "wb") as out:
            self.process = subprocess.Popen([program, *[f.format(profile=self.profile.name) for f in flags]],
                                            stdin=subprocess.DEVNULL, stdout=out, stderr=out,
                                            env={**os.environ, "HOME": self.profile.name, **self.environment})
        try:
            self.socket = Socket(self.wait_for(log, announces))
            self.begin()
        except BaseException:
            self.close()
            raise

    def wait_for(self, log, announces):
        end = time.monotonic() + START
        while time.monotonic() < end and self.process.poll() is None:
            found = re.search(announces, log.read_text(errors="replace"))
            if found:
                return found[1]
            time.sleep(0.1)
        raise OSError(f"{self.process.args[0]} did not start: {log.read_text(errors='replace')[-600:]}")

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.socket.send(json.dumps(message))
        while True:
            answer = json.loads(self.socket.receive())
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise OSError(f"{method}: {answer}")
                return answer["result"]
            self.hear(answer)

    def close(self):
        self.process.kill()
        self.process.wait()
        if hasattr(self, "socket"):
            self.socket.socket.close()
        self.profile.cleanup()


class Chromium(Browser):
    session, preferences, environment = None, {}, {}

    def __init__(self):
        super().__init__(shutil.which("chromium"),
                         ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                          "--remote-debugging-port=0", "--user-data-dir={profile}", "--no-first-run",
                          "--disable-dev-shm-usage", "--disable-background-networking", "--hide-scrollbars",
                          "--force-color-profile=srgb", "about:blank"], r"DevTools listening on (ws://\S+)")

    def begin(self):
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def hear(self, event):
        values = event.get("params", {})
        if event["method"] == "Runtime.exceptionThrown":
            self.errors.append(str(values["exceptionDetails"])[:400])
        elif event["method"] == "Runtime.consoleAPICalled" and values["type"] in ("error", "warning", "assert"):
            self.errors.append(str(values["args"])[:400])
        elif event["method"] == "Log.entryAdded" and values["entry"]["level"] in ("error", "warning"):
            if "GPU stall due to ReadPixels" not in values["entry"]["text"]:  # what reading a depth costs
                self.errors.append(str(values["entry"])[:400])

    def open(self, url):
        self.call("Page.navigate", url=url)
        while self.evaluate("document.readyState") != "complete":
            time.sleep(0.05)

    def evaluate(self, script):
        """The value of an expression, waited for where it is a promise."""
        answer = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise OSError(str(answer["exceptionDetails"])[:600])
        return answer["result"].get("value")

    def resize(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def screenshot(self):
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def press(self, key, code):
        for kind in ("rawKeyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code)


class Firefox(Browser):
    """On a screen of its own: without one it has no WebGL."""
    session = None

    def __init__(self):
        read, write = os.pipe()
        self.screen = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1400x1000x24", "-nolisten",
                                        "tcp"], pass_fds=[write], stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as number:
            self.environment = {"DISPLAY": ":" + number.readline().strip()}
        # software GL is Mesa's here, which Firefox would rather not use
        self.preferences = {"webgl.force-enabled": True, "layers.acceleration.disabled": True,
                            "browser.shell.checkDefaultBrowser": False,
                            "datareporting.policy.dataSubmissionEnabled": False,
                            "toolkit.telemetry.reportingpolicy.firstRun": False}
        super().__init__(shutil.which("firefox-esr") or shutil.which("firefox"),
                         ["--no-remote", "--profile", "{profile}", "--remote-debugging-port", "0",
                          "about:blank"], r"WebDriver BiDi listening on (ws://\S+)")

    def wait_for(self, log, announces):
        return super().wait_for(log, announces) + "/session"

    def close(self):
        super().close()
        self.screen.terminate()
        self.screen.wait()

    def begin(self):
        self.call("session.new", capabilities={})
        self.page = self.call("browsingContext.getTree")["contexts"][0]["context"]
        self.call("session.subscribe", events=["log.entryAdded"])

    def hear(self, event):
        if event.get("method") == "log.entryAdded" and event["params"]["level"] in ("error", "warn"):
            self.errors.append(str(event["params"].get("text"))[:400])

    def open(self, url):
        self.call("browsingContext.navigate", context=self.page, url=url, wait="complete")

    def evaluate(self, script):
        if not script.endswith("\n1"):  # else a program, not an expression
            script = f"(async () => JSON.stringify(await ({script})))()"
        answer = self.call("script.evaluate", expression=script, target={"context": self.page}, awaitPromise=True)
        if answer["type"] != "success":
            raise OSError(str(answer["exceptionDetails"])[:600])
        value = answer["result"].get("value", "null")
        return json.loads(value) if isinstance(value, str) else value

    def resize(self, width, height):
        self.call("browsingContext.setViewport", context=self.page, viewport={"width": width, "height": height},
                  devicePixelRatio=1)

    def screenshot(self):
        return base64.b64decode(self.call("browsingContext.captureScreenshot", context=self.page)["data"])


def found():
    """The browsers of this machine, as classes."""
    chromium, firefox = shutil.which("chromium"), shutil.which("firefox-esr") or shutil.which("firefox")
    return [Chromium] * bool(chromium) + [Firefox] * bool(firefox and shutil.which("Xvfb"))
