#!/usr/bin/env python3
"""itn view as browsers, and others, meet it: server.py ITN"""
import contextlib
import http.client
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools/lab"))
sys.dont_write_bytecode = True
from view_client import View  # noqa: E402

ITN = "build/bin/itn"
BALL = str(ROOT / "tests/tool/data/ball.xml")


def raw(port, data, wait=5):
    """What comes back for these bytes until the connection is closed; None where it stays open."""
    with socket.create_connection(("127.0.0.1", port), timeout=wait) as connection:
        answer = b""
        try:
            connection.sendall(data)
            while part := connection.recv(65536):
                answer += part
        except (ConnectionResetError, BrokenPipeError):
            pass
        except socket.timeout:
            return None
        return answer


def status(answer):
    return int(answer.split()[1]) if answer else 0


class Server(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.view = View(ITN, [BALL, "--spp", "32"])
        cls.view.first_picture()

    @classmethod
    def tearDownClass(cls):
        cls.view.__exit__()

    def get(self, target, host=None, extra=""):
        host = host or f"127.0.0.1:{self.view.port}"
        return raw(self.view.port, f"GET {target} HTTP/1.1\r\nHost: {host}\r\n{extra}Connection: close\r\n\r\n".encode())

    def test_the_page_and_its_parts_are_served_and_nothing_else_is_loaded(self):
        for path, kind in (("/", "text/html"), ("/view.css", "text/css"), ("/view.js", "text/javascript")):
            code, headers, body = self.view.ask(path)
            self.assertEqual(code, 200)
            self.assertTrue(headers["Content-Type"].startswith(kind))
            self.assertIn("default-src 'self'", headers["Content-Security-Policy"])
            self.assertEqual(headers["Referrer-Policy"], "no-referrer")
            self.assertNotIn(b"https://", body)
            self.assertNotIn(b"style=", body)

    def test_without_the_token_there_is_nothing(self):
        token = self.view.token
        for target in ("/", f"/{token}", f"/{token[:-1]}/", f"/{token}0/", f"/{'0' * len(token)}/frame", f"//{token}/",
                       f"/x/../{token}/", "*", f"http://127.0.0.1/{token[:-1]}/"):
            answer = self.get(target)
            self.assertIn(status(answer), (400, 403), target)
            self.assertNotIn(token.encode(), answer)
        self.assertEqual(status(self.get(f"/{token}/parameters")), 200)

    def test_other_names_of_the_host_and_other_pages_are_refused(self):
        page = f"/{self.view.token}/parameters"
        for host in ("evil.example", f"evil.example:{self.view.port}", "127.0.0.1", "127.0.0.1:1", "[::1]", ""):
            self.assertIn(status(self.get(page, host=host) if host else raw(
                self.view.port, f"GET {page} HTTP/1.1\r\nConnection: close\r\n\r\n".encode())), (400, 421), host)
        self.assertEqual(status(self.get(page, host=f"localhost:{self.view.port}")), 200)
        self.assertEqual(status(self.get(page, extra="Origin: http://evil.example\r\n")), 403)
        self.assertEqual(status(self.get(page, extra="Origin: null\r\n")), 403)
        self.assertEqual(status(self.get(page, extra=f"Origin: http://127.0.0.1:{self.view.port}\r\n")), 200)

    def test_only_this_machine_can_connect(self):
        with open("/proc/net/tcp", encoding="ascii") as file:
            listening = [line.split()[1] for line in file if line.split()[3] == "0A"]
        mine = [address for address in listening if address.endswith(f":{self.view.port:04X}")]
        self.assertEqual(mine, [f"0100007F:{self.view.port:04X}"])

    def test_no_path_leads_out(self):
        for path in ("/../../etc/passwd", "/..%2f..%2fetc/passwd", "/%2e%2e/", "/view.js/..", "/index.html%00", "/frame/../x",
                     "/scene.xml/", "/etc/passwd"):
            answer = self.get(f"/{self.view.token}{path}")
            self.assertEqual(status(answer), 404, path)
            self.assertNotIn(b"root:", answer)

    def test_hostile_requests_end_in_a_refusal_and_the_server_goes_on(self):
        port, token = self.view.port, self.view.token
        head = f"Host: 127.0.0.1:{port}\r\n"
        requests = [
            b"\r\n\r\n", b"\0" * 100, b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", os.urandom(4096),
            f"GET /{token}/ HTTP/1.1\r\n{head}X: {'a' * 100000}\r\n\r\n".encode(),
            f"GET /{token}/{'a' * 100000} HTTP/1.1\r\n{head}\r\n".encode(),
            (f"GET /{token}/ HTTP/1.1\r\n{head}" + "A: b\r\n" * 100000 + "\r\n").encode(),
            f"POST /{token}/set HTTP/1.1\r\n{head}Content-Length: 99999999999\r\n\r\n".encode(),
            f"POST /{token}/set HTTP/1.1\r\n{head}Content-Length: -1\r\n\r\n".encode(),
            f"POST /{token}/set HTTP/1.1\r\n{head}Transfer-Encoding: chunked\r\n\r\nFFFFFFFF\r\n".encode() + b"x" * 200000,
            f"POST /{token}/set HTTP/1.1\r\n{head}Content-Length: 70000\r\n\r\n".encode() + b"x" * 70000,
        ]
        for request in requests:
            answer = raw(port, request, wait=20)
            self.assertIsNotNone(answer, request[:60])
            self.assertIn(status(answer), (0, 400, 413), request[:60])
        for _ in range(40):
            self.assertIn(status(raw(port, os.urandom(300) + b"\r\n\r\n", wait=20)), (0, 400, 413))
        self.assertEqual(self.view.ask("/parameters")[0], 200)

    def test_what_is_no_value_is_told(self):
        before = self.view.tell("/set", {})["revision"]
        name = "skin.sigma_t"
        for body in ({name: -1}, {name: "8"}, {name: None}, {name: {}}, {"no.such": 1}, {name: [1]}, [1], "text", 5,
                     [], True, {name: True}, {name: 1e300}, {name: 1e31}, {name: -1e300}):
            code, _, text = self.view.ask("/set", body)
            self.assertEqual(code, 400, body)
            self.assertIn("error", json.loads(text))
        twice = f'{{"{name}": 5, "{name}": 6}}'.encode()
        for path in ("/set", "/look"):
            for body in (b"", b"{", b"{\"a\": 1e999}", b"[" * 60000, b"\xff\xfe", b"[]", b"null", twice,
                         b'{"exposure": 1, "exposure": 2}', b"{} {}"):
                self.view.connection.request("POST", f"/{self.view.token}{path}", body)
                answer = self.view.connection.getresponse()
                self.assertIn("error", json.loads(answer.read()))
                self.assertEqual(answer.status, 400, body[:20])
        for body in ({"derivative": "no.such"}, {"fit": [name]}, {"fit": "x"}, {"exposure": {}}, {"derivative": 3},
                     {"exposure": True}, {"exposure": "dark"}, {"exposure": None}, {"other": 1}, {"fit": []}):
            self.assertEqual(self.view.ask("/look", body)[0], 400, body)
        self.assertEqual(self.view.tell("/set", {})["revision"], before)
        self.assertEqual(self.view.ask("/nothing")[0], 404)
        self.assertEqual(self.view.ask("/frame", {})[0], 404)  # POST

    def test_two_clients_see_the_same(self):
        other = http.client.HTTPConnection("127.0.0.1", self.view.port, timeout=30)
        revision = self.view.tell("/set", {"skin.sigma_t": 7.5})["revision"]
        seen = []

        def look():
            after = 0
            for _ in range(100):
                numbers, pictures = self.view.frame(after, connection=other)
                after = numbers["number"]
                if numbers["revision"] == revision and numbers["done"]:
                    seen.append((numbers, pictures["image"]))
                    return

        thread = threading.Thread(target=look)
        thread.start()
        after = 0
        for _ in range(100):
            numbers, pictures = self.view.frame(after)
            after = numbers["number"]
            if numbers["revision"] == revision and numbers["done"]:
                break
        thread.join()
        self.assertEqual(seen[0][0]["values"], numbers["values"])
        self.assertIn(7.5, numbers["values"])
        self.assertEqual(seen[0][1], pictures["image"])
        other.close()

    def test_what_is_seen_is_saved(self):
        self.view.tell("/set", {"skin.sigma_t": 6.25})
        with tempfile.TemporaryDirectory() as folder:
            for file, begin in (("scene.xml", b"<?xml"), ("image.exr", b"\x76\x2f\x31\x01"), ("image.png", b"\x89PNG")):
                code, headers, body = self.view.ask(f"/{file}")
                self.assertEqual(code, 200)
                self.assertTrue(body.startswith(begin))
                self.assertIn(f'filename="ball-view.{file[-3:]}"', headers["Content-Disposition"])
                (Path(folder) / file).write_bytes(body)
            listed = subprocess.run([ITN, "parameters", str(Path(folder) / "scene.xml"), "--json", "-"], check=True,
                                    capture_output=True, text=True)
            values = {p["name"]: p["value"] for p in json.loads(listed.stdout)["parameters"]}
            self.assertEqual(values["skin.sigma_t"], 6.25)


class Ends(unittest.TestCase):
    def test_the_file_with_the_token_is_for_its_owner_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "view.json"
            file.touch(0o644)
            view = subprocess.Popen([ITN, "view", BALL, "--json", str(file), "--quiet"], stderr=subprocess.PIPE)
            try:
                for _ in range(600):
                    if "address" in file.read_text():
                        break
                    time.sleep(0.05)
                self.assertIn("http://127.0.0.1", json.loads(file.read_text())["address"])
                self.assertEqual(file.stat().st_mode & 0o777, 0o600)
            finally:
                view.send_signal(signal.SIGINT)
                view.communicate()

    def test_ctrl_c_ends_within_a_second_also_while_a_page_waits(self):
        with View(ITN, [BALL, "--spp", "4"]) as view:
            view.first_picture()
            waiting = socket.create_connection(("127.0.0.1", view.port))
            waiting.sendall(f"GET /{view.token}/frame?after=99999 HTTP/1.1\r\nHost: 127.0.0.1:{view.port}\r\n\r\n".encode())
            time.sleep(0.2)
            view.process.send_signal(signal.SIGINT)
            start = time.perf_counter()
            self.assertEqual(view.process.wait(10), 130)
            self.assertLess(time.perf_counter() - start, 1.5)
            waiting.close()

    def test_a_killed_process_leaves_its_port(self):
        with View(ITN, [BALL]) as view:
            view.process.kill()
            view.process.wait()
            with View(ITN, [BALL, "--port", str(view.port)]) as again:
                self.assertEqual(again.port, view.port)
                self.assertNotEqual(again.token, view.token)
                self.assertEqual(again.ask("/parameters")[0], 200)

    def test_a_port_that_is_taken_is_told(self):
        with View(ITN, [BALL]) as view:
            second = subprocess.run([ITN, "view", BALL, "--port", str(view.port)], capture_output=True, text=True, check=False)
            self.assertEqual(second.returncode, 1)
            self.assertIn(f"port {view.port}", second.stderr)

    def test_wrong_command_lines_and_files(self):
        for arguments, code in ((["no.xml"], 3), ([BALL, "--port", "65536"], 2), ([BALL, "--mask", "m.exr"], 2),
                                ([BALL, "--target", "no.exr"], 3), ([BALL, "--sensor", "7"], 2)):
            ended = subprocess.run([ITN, "view", *arguments], capture_output=True, text=True, check=False)
            self.assertEqual(ended.returncode, code, arguments)


class Waiting(unittest.TestCase):
    """What takes the server seconds to notice, waited for at once."""

    @classmethod
    def setUpClass(cls):
        cls.unseen = View(ITN, [BALL, "--spp", "100000000", "--size", "256x256"])
        cls.addClassCleanup(cls.unseen.__exit__)
        cls.unseen.first_picture()
        cls.view = View(ITN, [BALL])
        cls.addClassCleanup(cls.view.__exit__)
        # More than are allowed at a time, and all of them begin a request that they do not end.
        cls.slow = [socket.create_connection(("127.0.0.1", cls.view.port)) for _ in range(60)]
        for connection in cls.slow:
            cls.addClassCleanup(connection.close)
            with contextlib.suppress(ConnectionError):  # closed already
                connection.sendall(b"GET /")
        begin = time.perf_counter()
        cls.answers = []
        for _ in range(3):
            with contextlib.closing(http.client.HTTPConnection("127.0.0.1", cls.view.port, timeout=8)) as fresh:
                cls.answers.append(cls.view.ask("/parameters", connection=fresh)[0])
        cls.seconds = time.perf_counter() - begin
        time.sleep(11.5 - cls.seconds)

    def test_slow_clients_do_not_lock_others_out(self):
        self.assertEqual(self.answers, [200, 200, 200])
        self.assertLess(self.seconds, 5)  # far from the ten that a request may take

    def test_a_request_that_does_not_end_is_given_up(self):
        for connection in self.slow:
            connection.settimeout(1)
            with contextlib.suppress(ConnectionError):
                self.assertEqual(connection.recv(100), b"")

    def test_nobody_looks_nothing_is_rendered(self):
        begin = _cpu_seconds(self.unseen.process.pid)  # longer ago than a tab may need to ask again
        time.sleep(1)
        self.assertLess(_cpu_seconds(self.unseen.process.pid) - begin, 0.15)
        numbers, _ = self.unseen.frame()
        later, _ = self.unseen.frame(numbers["number"])
        self.assertGreater(later["spp"], numbers["spp"])


def _cpu_seconds(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        ITN = sys.argv.pop(1)
    unittest.main()
