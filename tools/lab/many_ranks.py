#!/usr/bin/env python3
"""Is the work of several processes (mpirun -n N itn ..., itn dataset --part K/N) that of one, byte for byte, also after kills, and
what does it cost?

  tools/lab/many_ranks.py [--quick] [--ranks 2,4] [--kills 20] [--itn build/bin/itn] [--folder DIR] [--json FILE]

--quick: the bytes alone, of four small jobs. Else also: kill -9 of a rank at random moments, the time of 2 ranks with one thread each
beside one process with two threads, and messages and bytes a step. Exit code 1 where anything differs, 77 without mpirun."""
import argparse
import hashlib
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
# In containers everybody is root, and has fewer cores than ranks.
ENVIRONMENT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1",
               "OMPI_MCA_hwloc_base_binding_policy": "none"}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--ranks", default="2,4")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--itn", default=ROOT / "build/bin/itn", type=pathlib.Path)
    parser.add_argument("--folder", type=pathlib.Path, help="to work in; default: a temporary one")
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


class Job:
    """A command that writes into a folder, and which of its files must have the same bytes."""

    def __init__(self, name, command, kept):
        self.name, self.command, self.kept = name, command, kept

    def sums(self, folder):
        files = sorted({f for pattern in self.kept for f in folder.glob(pattern)})
        return {str(f.relative_to(folder)): hashlib.sha256(f.read_bytes()).hexdigest() for f in files}


def jobs_in(work, quick):
    config, ball, small = work / "config.json", ROOT / "tests/tool/data/ball.xml", ["--size", "33x17"]
    materials = 10 if quick else 40
    config.write_text(json.dumps({"preset": "tiny", "size": 16, "spp": 16, "boundary": {"type": "matched"},
                                  "train": {"shapes": ["knot"], "azimuths": [0, 60], "materials": materials},
                                  "test": {"shapes": ["hare"], "azimuths": [30], "materials": 4}}))
    wood = work / "wood.xml"
    wood.write_text("""<scene version="3.0.0"><integrator type="volpath"/>
  <sensor type="perspective"><transform name="to_world"><lookat origin="0, -3, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="33"/><integer name="height" value="17"/></film>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler></sensor>
  <emitter type="constant"/>
  <shape type="sphere"><bsdf type="diffuse" id="wood"><texture type="bitmap" name="reflectance">
    <string name="filename" value="wood.exr"/><boolean name="raw" value="true"/></texture></bsdf></shape></scene>
""")
    data, run = work / "dataset.one", ["--epochs", "3", "--batch", "8", "--shards", "4"]
    jobs = [
        Job("dataset", lambda to: ["dataset", config, "-o", to], ["manifest.json", "images/*", "shapes/*"]),
        Job("render", lambda to: ["render", ball, "-o", to / "image.exr", *small, "--spp", "32", "--derivative", "skin.sigma_t"],
            ["image.exr"]),
        Job("gradient", lambda to: ["gradient", ball, "--target", work / "render.one/image.exr", *small, "--spp", "32",
                                    "--parameter", "skin.sigma_t", "--mode", "adjoint", "-D", "sigma_t=4", "--json", to / "g.json"],
            ["numbers.json"]),
        Job("invert", lambda to: ["invert", ball, "--target", work / "render.one/image.exr", *small, "--parameter", "skin.sigma_t",
                                  "--start", "skin.sigma_t=5", "--iterations", "4", "--spp", "16", "-o", to],
            ["iterations.jsonl", "*.exr"]),
        Job("texture", lambda to: ["invert", wood, "--target", work / "texture.target/image.exr", "--parameter", "wood.reflectance",
                                   "--iterations", "4", "--spp", "8", "-o", to], ["iterations.jsonl", "*.exr"]),
        Job("train", lambda to: ["train", data, "--network", "rn", "-o", to, *run],
            ["network.safetensors", "checkpoint.safetensors", "curve.jsonl", "run.json"]),
        Job("train itn", lambda to: ["train", data, "--network", "itn", "-o", to, "--epochs", "1", *run[2:]],
            ["network.safetensors", "checkpoint.safetensors", "curve.jsonl", "run.json"]),
        Job("eval", lambda to: ["eval", data, work / "train.one", work / "train itn.one", "-o", to, "--images", "6", "--inversions",
                                "1", "--iterations", "4"], ["*.png"]),
    ]
    return [j for j in jobs if not quick or j.name in ("dataset", "render", "gradient", "train")]


class Runner:
    def __init__(self, options, work):
        self.options, self.work, self.failed = options, work, False
        self.environment = {**os.environ, **ENVIRONMENT}

    def start(self, ranks, command, threads=0, **more):
        environment = dict(self.environment)
        if threads:
            environment.update(POCL_MAX_PTHREAD_COUNT=str(threads), OMP_NUM_THREADS=str(threads))
        launcher = ["mpirun", "-n", str(ranks)] if ranks else []
        return subprocess.Popen([*launcher, *map(str, [self.options.itn, *command])], env=environment, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True, **more)

    def run(self, ranks, command, good=(0,), threads=0):
        process = self.start(ranks, command, threads)
        output = process.communicate(timeout=1200)[0]
        if process.returncode not in good:
            sys.exit(f"{' '.join(map(str, command))} with {ranks or 'no'} ranks: exit code {process.returncode}\n{output}")
        return output

    def compare(self, what, job, first, second):
        a, b = job.sums(first), job.sums(second)
        same = a == b and bool(a)
        self.failed |= not same
        print(f"{what:<44} {'the same bytes' if same else 'DIFFERS: ' + str(sorted(k for k in a | b if a.get(k) != b.get(k)))}",
              flush=True)


def do(runner, job, ranks, folder):
    folder.mkdir(exist_ok=True)
    runner.run(ranks, [*job.command(folder), "--quiet"], good=(0, 1) if "invert" in job.command(folder)[0] else (0,))
    if job.name == "gradient":  # without its times
        numbers = json.loads((folder / "g.json").read_text())
        (folder / "numbers.json").write_text(json.dumps({k: numbers[k] for k in ("loss", "loss_stderr", "gradient")}))


def same_bytes(runner, jobs, ranks):
    for job in jobs:
        one = runner.work / f"{job.name}.one"
        if job.name == "texture":  # a target, by another picture
            (runner.work / "texture.target").mkdir()
            shutil.copy(runner.work / "render.one/image.exr", runner.work / "wood.exr")
            runner.run(0, ["render", runner.work / "wood.xml", "-o", runner.work / "texture.target/image.exr", "--quiet", "--seed", "3"])
        do(runner, job, 0, one)
        for n in ranks:
            several = runner.work / f"{job.name}.{n}"
            do(runner, job, n, several)
            runner.compare(f"{job.name}: one process and {n} ranks", job, one, several)


def parts(runner, job):
    to, count = runner.work / "parts", 3
    command = job.command(to)
    processes = [runner.start(0, [*command, "--part", f"{k}/{count}", "--quiet"]) for k in (3, 1)]
    for process in processes:
        if process.wait() != 0:
            sys.exit(process.stdout.read())
    refused = runner.start(0, [*command, "--merge", "--quiet"])
    message = refused.communicate()[0]
    if refused.returncode != 1 or "missing" not in message:
        runner.failed = True
        print(f"--merge without part 2: exit code {refused.returncode}, {message}")
    runner.run(0, [*command, "--part", f"2/{count}", "--quiet"])
    runner.run(0, [*command, "--merge", "--quiet"])
    runner.compare(f"dataset: one process and {count} parts", job, runner.work / "dataset.one", to)


def descendants(pid):
    found, waiting = [], [pid]
    while waiting:
        for task in pathlib.Path(f"/proc/{waiting.pop()}/task").glob("*/children"):
            children = [int(c) for c in task.read_text().split()]
            found += children
            waiting += children
    return found


def kills(runner, jobs, count, ranks):
    """The same command again and again, each time with a rank killed, until it is done."""
    chance = random.Random(runner.options.seed)
    for job in jobs:
        folder, one = runner.work / f"{job.name}.killed", runner.work / f"{job.name}.one"
        start = time.time()
        do(runner, job, ranks, runner.work / f"{job.name}.timed")
        whole, killed, codes = time.time() - start, 0, {}
        while killed < count:
            process = runner.start(ranks, [*job.command(folder), "--quiet"])
            time.sleep(chance.uniform(0.1, 0.7) * whole)
            try:
                mine = [p for p in descendants(process.pid) if os.readlink(f"/proc/{p}/exe") == str(runner.options.itn.resolve())]
                os.kill(chance.choice(mine), signal.SIGKILL)
                killed += 1
            except (OSError, IndexError):
                pass  # it was done, or had not begun
            try:
                process.communicate(timeout=60)
            except subprocess.TimeoutExpired:
                runner.failed = True
                process.kill()
                print(f"{job.name}: the others did not end")
            codes[process.returncode] = codes.get(process.returncode, 0) + 1
            if process.returncode == 0:
                runner.compare(f"{job.name}: done after {killed} kills", job, one, folder)
                shutil.rmtree(folder)
        do(runner, job, ranks, folder)
        runner.compare(f"{job.name}: after {killed} kills", job, one, folder)
        print(f"  exit codes of mpirun: {codes}")


def efficiency(runner, report):
    config = runner.work / "large.json"
    config.write_text(json.dumps({"preset": "tiny", "size": 32, "spp": 256, "boundary": {"type": "matched"},
                                  "train": {"shapes": ["knot"], "azimuths": [0], "materials": 60},
                                  "test": {"shapes": ["knot"], "azimuths": [], "materials": 1}} | {"test": {"shapes": ["hare"],
                                  "azimuths": [30], "materials": 2}}))
    ball = ROOT / "scenes/gallery/jade.xml"
    ball = ball if ball.exists() else ROOT / "tests/tool/data/ball.xml"
    cases = {"dataset": lambda to: ["dataset", config, "-o", to / "set"],
             "render": lambda to: ["render", ball, "-o", to / "image.exr", "--size", "256x256", "--spp", "256"]}
    for name, command in cases.items():
        times = {1: [], 2: []}
        for repeat in range(4):
            for ranks in (1, 2):
                to = runner.work / f"efficiency.{name}.{ranks}.{repeat}"
                to.mkdir()
                runner.run(ranks, [*command(to), "--json", to / "r.json", "--quiet"], threads=2 // ranks)
                if repeat > 0:  # the first fills the kernel cache
                    times[ranks].append(json.loads((to / "r.json").read_text())["time"]["render_s"])
        one, two = min(times[1]), min(times[2])
        report["efficiency"][name] = {"one_process_two_threads_s": one, "two_ranks_one_thread_s": two, "efficiency": one / two}
        print(f"{name}: 1 x 2 threads {one:.2f} s, 2 ranks x 1 thread {two:.2f} s: efficiency {one / two:.2f}", flush=True)


def traffic(runner, jobs, report):
    """Of the first rank, from the JSON of a job of 2 ranks."""
    for name, steps in (("dataset", 0), ("render", 1), ("train", 0), ("train itn", 0)):
        job = next(j for j in jobs if j.name == name)
        to, file = runner.work / f"{name}.traffic", runner.work / f"{name}.traffic.json"
        to.mkdir()
        runner.run(2, [*job.command(to), "--quiet", "--json", file])
        result = json.loads(file.read_text())
        steps = result.get("steps", steps) or result.get("images", 1)
        ranks = result["ranks"]
        report["traffic"][name] = {**ranks, "steps": steps}
        print(f"{name}: {ranks['messages'] / steps:.1f} messages and {ranks['bytes'] / steps:.4g} bytes a "
              f"{'image' if name == 'dataset' else 'step'}, of {steps}", flush=True)


def main():
    options = arguments()
    if shutil.which("mpirun") is None:
        print("mpirun is not there (Debian: openmpi-bin): nothing is tested")
        return 77
    options.itn = options.itn.resolve()
    with tempfile.TemporaryDirectory() as folder:
        work = options.folder or pathlib.Path(folder)
        work.mkdir(parents=True, exist_ok=True)
        runner, report = Runner(options, work), {"efficiency": {}, "traffic": {}}
        probe = runner.start(2, ["--version"])
        if "built without MPI" in probe.communicate()[0]:
            print("this itn was built without MPI (Debian: libopenmpi-dev): nothing is tested")
            return 77
        jobs = jobs_in(work, options.quick)
        ranks = [int(n) for n in options.ranks.split(",")]
        same_bytes(runner, jobs, ranks)
        parts(runner, jobs[0])
        if not options.quick:
            kills(runner, [j for j in jobs if j.name in ("dataset", "train")], options.kills, max(ranks))
            efficiency(runner, report)
            traffic(runner, jobs, report)
        if options.json:
            options.json.write_text(json.dumps(report, indent=1) + "\n")
        return 1 if runner.failed else 0


if __name__ == "__main__":
    sys.exit(main())
