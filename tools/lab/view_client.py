"""Talks to `itn view` as its page does: for tools/lab/view_bench.py, tools/lab/view_pictures.py and tests/view/server.py."""
import http.client
import json
import signal
import subprocess
import time
import urllib.parse


class View:
    """A running `itn view`, ended with the block."""

    def __init__(self, itn, arguments, environment=None):
        self.start = time.perf_counter()
        self.process = subprocess.Popen([itn, "view", *arguments, "--json", "-"], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True, env=environment)
        text = ""
        while True:  # the JSON is complete before anything is served
            line = self.process.stdout.readline()
            text += line
            if line in ("}\n", ""):
                break
        if not text:
            raise RuntimeError(self.process.stderr.read())
        self.result = json.loads(text)
        self.address = self.result["address"]
        self.port = self.result["port"]
        self.token = urllib.parse.urlparse(self.address).path.strip("/")
        self.connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.connection.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        self.process.wait(30)
        self.process.stdout.close()
        self.process.stderr.close()

    def ask(self, path, body=None, connection=None, headers=None):
        """(status, headers, bytes) of a path behind the token."""
        connection = connection or self.connection
        request = ("GET" if body is None else "POST", f"/{self.token}{path}", None if body is None else json.dumps(body),
                   headers or {})
        try:
            connection.request(*request)
            answer = connection.getresponse()
        except (http.client.RemoteDisconnected, ConnectionError):  # idle for too long: as browsers do
            connection.close()
            connection.request(*request)
            answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()

    def ask_json(self, path):
        return json.loads(self.ask(path)[2])

    def tell(self, path, body):
        return json.loads(self.ask(path, body)[2])

    def frame(self, after=0, look=0, connection=None):
        """A frame's numbers, and its pictures as bytes by name."""
        body = self.ask(f"/frame?after={after}&look={look}", connection=connection)[2]
        length = int.from_bytes(body[:4], "little")
        numbers = json.loads(body[4:4 + length])
        count = len(numbers["pictures"])
        size = (len(body) - 4 - length) // count if count else 0
        pictures = {name: body[4 + length + k * size:4 + length + (k + 1) * size]
                    for k, name in enumerate(numbers["pictures"])}
        return numbers, pictures

    def first_picture(self):
        """Seconds from the start of the process to the first picture, and its frame."""
        after = 0
        while True:
            numbers, pictures = self.frame(after)
            if pictures:
                return time.perf_counter() - self.start, numbers
            after = numbers["number"]

    def picture_of(self, revision, after=0):
        """The first frame of that revision of the values or a later one."""
        while True:
            numbers, _ = self.frame(after)
            if numbers["revision"] >= revision:
                return numbers
            after = numbers["number"]
