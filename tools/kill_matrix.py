#!/usr/bin/env python3
"""Kills itn with SIGKILL at random moments, again and again, until the job is done, and compares the bytes with those of a job that
was never killed: data sets, trainings, inversions. Then looks for files that the kills have left.

  tools/kill_matrix.py [--kills N] [--jobs dataset,train,invert] [--itn build/bin/itn] [--folder DIR]

Exit code 1 where anything differs or is left. The same seed kills at the same moments, as far as the machine is as fast."""
import argparse
import hashlib
import json
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100, help="of each job [100]")
    parser.add_argument("--jobs", default="dataset,train,invert")
    parser.add_argument("--itn", default=ROOT / "build/bin/itn", type=pathlib.Path)
    parser.add_argument("--folder", type=pathlib.Path, help="to work in; default: a temporary one")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


class Job:
    """A command for a folder, and which of its files must not depend on interruptions."""

    def __init__(self, name, command, kept):
        self.name, self.command, self.kept = name, command, kept

    def start(self, itn, folder):
        return subprocess.Popen([str(itn), *self.command(folder), "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    def sums(self, folder):
        files = sorted(f for pattern in self.kept for f in folder.glob(pattern))
        return {str(f.relative_to(folder)): hashlib.sha256(f.read_bytes()).hexdigest() for f in files}


def jobs_in(work):
    config = work / "config.json"
    side = {"shapes": ["knot"], "azimuths": [0, 60], "materials": 20}
    config.write_text(json.dumps({"preset": "tiny", "size": 16, "spp": 32, "train": side,
                                  "test": {"shapes": ["hare"], "azimuths": [30], "materials": 4}}))
    ball = ROOT / "tests/tool/data/ball.xml"
    target = work / "target.exr"
    return [
        Job("dataset", lambda to: ["dataset", str(config), "-o", str(to)], ["manifest.json", "images/*", "shapes/*"]),
        Job("train", lambda to: ["train", str(work / "dataset.whole"), "--network", "rn", "-o", str(to), "--epochs", "60",
                                 "--batch", "8", "--checkpoint-every", "0.2", "--threads", "1"],
            ["network.safetensors", "curve.jsonl"]),
        Job("invert", lambda to: ["invert", str(ball), "--target", str(target), "--size", "16x12", "--parameter", "skin.sigma_t",
                                  "--method", "adam", "--iterations", "60", "--spp", "8", "--start",
                                  "skin.sigma_t=5", "-o", str(to)],
            ["state.json", "iterations.jsonl"]),
    ]


def run_whole(job, itn, folder):
    start = time.monotonic()
    process = job.start(itn, folder)
    error = process.communicate()[1].decode(errors="replace")
    if process.returncode not in (0, 1):  # 1: an inversion that has not converged
        sys.exit(f"{job.name}: exit code {process.returncode}: {error}")
    return time.monotonic() - start, process.returncode


def kill_until_done(job, itn, folder, seconds, moments):
    """Returns how often it was killed before it was done."""
    kills = 0
    while True:
        process = job.start(itn, folder)
        try:
            process.wait(timeout=moments.uniform(0, seconds))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            kills += 1
            if kills < 200:
                continue
            process = job.start(itn, folder)
        error = process.communicate()[1].decode(errors="replace")
        if process.returncode not in (0, 1):
            sys.exit(f"{job.name}: after {kills} kills exit code {process.returncode}: {error}")
        return kills


def main():
    options = arguments()
    work = options.folder or pathlib.Path(tempfile.mkdtemp(prefix="itn_kills_"))
    work.mkdir(parents=True, exist_ok=True)
    itn = options.itn.resolve()
    subprocess.run([str(itn), "render", str(ROOT / "tests/tool/data/ball.xml"), "--size", "16x12", "--spp", "256", "-o",
                    str(work / "target.exr"), "--quiet"], check=True)
    moments = random.Random(options.seed)
    failed = False
    for job in jobs_in(work):
        if job.name not in options.jobs.split(",") and job.name != "dataset":
            continue
        whole = work / f"{job.name}.whole"
        run_whole(job, itn, whole)
        seconds, code = run_whole(job, itn, work / f"{job.name}.again")  # compiled kernels are there now
        expected = job.sums(whole)
        if job.sums(work / f"{job.name}.again") != expected or not expected:
            sys.exit(f"{job.name}: two whole runs differ: nothing to compare with")
        if job.name not in options.jobs.split(","):
            continue
        kills = rounds = 0
        while kills < options.kills:
            parts = work / f"{job.name}.parts"
            shutil.rmtree(parts, ignore_errors=True)
            kills += kill_until_done(job, itn, parts, seconds, moments)
            rounds += 1
            found = job.sums(parts)
            for name in sorted(set(expected) | set(found)):
                if expected.get(name) != found.get(name):
                    failed = True
                    print(f"{job.name}: {name} differs after kills")
            left = [str(f) for f in parts.rglob("*.tmp-*")]
            if left:
                failed = True
                print(f"{job.name}: left behind: {', '.join(left)}")
        print(f"{job.name}: {kills} kills in {rounds} jobs of {seconds:.1f} s{' FAILED' if failed else ''}", flush=True)
    if not options.folder:
        shutil.rmtree(work)
    sys.exit(failed)


main()
