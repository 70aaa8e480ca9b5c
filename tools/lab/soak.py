#!/usr/bin/env python3
"""Mixed work for a given time: does memory stay flat, does every command end as it should, and do the bytes stay the same?

  tools/lab/soak.py MINUTES [--itn build/bin/itn] [--json FILE]

Three processes at once draw commands (renderings, gradients, data sets, trainings, predictions, inversions, evaluations) until
time is up, on one cache of kernels that is empty at the start; a fourth, one `itn view`, gets a picture with changed parameters again and again,
and is what memory is watched of. Every command's files must be those of its first run. Exit code 1 where a command
fails, bytes differ, a file is left, or the server's memory grows by more than 5 % from the first third to the last."""
import argparse
import collections
import json
import os
import pathlib
import random
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time

from resumable_jobs import ROOT, contents, jobs, run_whole, write_inputs
from view_client import View


class Soak:
    def __init__(self, itn, work, end, environment):
        self.itn, self.work, self.end, self.environment = itn, work, end, environment
        self.lock = threading.Lock()
        self.first, self.counts, self.failures, self.most = {}, collections.Counter(), [], collections.Counter()

    def commands(self):
        for job in jobs():
            yield job.name, [*job.arguments], "folder"
        yield "render", ["render", "scene.xml", "--spp", "64", "--derivative", "skin.sigma_t"], "file"
        yield "render-ball", ["render", str(ROOT / "tests/tool/data/ball.xml"), "--spp", "16"], "file"
        yield "gradient", ["gradient", "scene.xml", "--target", "target.exr", "--parameter", "skin.sigma_t", "--spp", "16"], "json"
        yield "predict", ["predict", "run", "set/images/000003.exr", "--dataset", "set"], "json"
        yield "parameters", ["parameters", "scene.xml"], "json"

    def worker(self, number):
        choose, own = random.Random(number), self.work / f"worker-{number}"  # results tell the names of their files
        while time.monotonic() < self.end:
            name, arguments, kind = choose.choice(list(self.commands()))
            option, place = {"folder": ("-o", "out"), "file": ("-o", "out.exr"), "json": ("--json", "out.json")}[kind]
            process = subprocess.Popen([str(self.itn), *arguments, option, place, "--quiet"], cwd=own, env=self.environment,
                                       stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            error = process.stderr.read().decode(errors="replace")
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            place = own / place
            if kind == "folder":
                found = contents(place)
                shutil.rmtree(place, ignore_errors=True)
            else:
                text = place.read_bytes() if place.exists() else b""
                found = re.sub(rb'"[a-z_]*_s": [-0-9.e+]+', b"", text) if kind == "json" else text
                place.unlink(missing_ok=True)
            with self.lock:
                self.counts[name] += 1
                self.most[name] = max(self.most[name], usage.ru_maxrss // 1024)
                if process.returncode not in (0, 1) or (process.returncode == 1 and "not converged" not in error):
                    self.failures.append(f"{name}: exit code {process.returncode}: {error.strip()[:300]}")
                elif self.first.setdefault(name, found) != found:
                    self.failures.append(f"{name}: other bytes than the first time")

    def view(self):
        """A server whose parameters change; its memory [MiB], a value a picture."""
        choose, sizes = random.Random(0), []
        with View(str(self.itn), [str(self.work / "scene.xml"), "--target", str(self.work / "target.exr")], self.environment) as view:
            view.first_picture()
            while time.monotonic() < self.end:
                revision = view.tell("/set", {"skin.sigma_t": choose.uniform(2, 40)})["revision"]
                view.picture_of(revision)
                status = pathlib.Path(f"/proc/{view.process.pid}/status").read_text()
                sizes.append(int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024)
                time.sleep(0.5)
        return sizes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("minutes", type=float)
    parser.add_argument("--itn", default=ROOT / "build/bin/itn", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="itn_soak_") as folder:
        work = pathlib.Path(folder)
        environment = os.environ | {"POCL_CACHE_DIR": str(work / "cache"), "TMPDIR": str(work / "tmp")}
        (work / "tmp").mkdir()
        itn = options.itn.resolve()
        write_inputs(itn, work)
        for job in jobs():
            if job.name in ("dataset", "train"):  # whose results others need
                run_whole(job, itn, work)
        inputs = list(work.iterdir())
        for number in range(3):
            (work / f"worker-{number}").mkdir()
            for path in inputs:
                (work / f"worker-{number}" / path.name).symlink_to(path)
        begin = time.monotonic()
        soak = Soak(itn, work, begin + 60 * options.minutes, environment)
        everything = lambda: {str(p) for folder in [work, work / "tmp", *work.glob("worker-*")] for p in folder.iterdir()}
        expected = everything() | {str(work / "cache")}
        workers = [threading.Thread(target=soak.worker, args=(number,)) for number in range(3)]
        for worker in workers:
            worker.start()
        sizes = soak.view()
        for worker in workers:
            worker.join()
        left = sorted(everything() - expected)
        minutes = (time.monotonic() - begin) / 60
    if not sizes:
        soak.failures.append("view: no picture in time")
        sizes = [0]
    third = max(1, len(sizes) // 3)
    early, late = statistics.median(sizes[:third]), statistics.median(sizes[-third:])
    result = {"minutes": minutes, "commands": sum(soak.counts.values()), "by_command": soak.counts, "most_MiB": soak.most,
              "pictures": len(sizes), "server_MiB": [early, late], "left": left, "failures": soak.failures}
    text = json.dumps(result, indent=1)
    print(text)
    if options.json:
        options.json.write_text(text)
    sys.exit(1 if soak.failures or left or late > 1.05 * early else 0)


main()
