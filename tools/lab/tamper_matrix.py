#!/usr/bin/env python3
"""Changes inputs behind itn's back, and asks for outputs that are inputs.

  tools/lab/tamper_matrix.py [--itn build/bin/itn] [--parts tamper,alias] [--quick]

tamper: each command that goes on where it was is stopped with SIGKILL on its way; then each of its inputs and of the files that it
has written so far is changed (a bit of one byte, at three places; cut to half; exchanged with another of its kind), and the command is
called again. It must refuse, with a message, or end with the files of a job in which nothing was changed.

alias: each option of each command that names an output gets each of the command's inputs. It must refuse with exit code 2 and leave
the inputs as they were.

Exit code 1 where something else happens. --quick: one change an input, without the slow commands."""
import argparse
import collections
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from resumable_jobs import ROOT, jobs, run_whole, write_inputs


def flipped(data, part):
    at = min(int(len(data) * part), len(data) - 1)
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1:]


def changes(data, other, quick):
    yield "a bit in the middle", flipped(data, 0.5)
    if quick:
        return
    yield "a bit near the beginning", flipped(data, 0.1)
    yield "a bit near the end", flipped(data, 0.95)
    yield "cut to half", data[:len(data) // 2]
    if other is not None and other != data:
        yield "exchanged", other


def stop_on_the_way(job, itn, work):
    """Starts the job and kills it when it is on its way. Returns the files that are there."""
    folder = work / job.output
    shutil.rmtree(folder, ignore_errors=True)
    process = job.start(itn, work)
    while process.poll() is None and not (folder / job.half_way).exists():
        time.sleep(0.002)
    process.kill()
    process.communicate()
    return sorted(p for p in folder.rglob("*") if p.is_file())


class Matrix:
    def __init__(self, itn, work, quick):
        self.itn, self.work, self.quick = itn, work, quick
        self.failures, self.counts = 0, collections.Counter()

    def fail(self, text):
        self.failures += 1
        print(text, flush=True)

    def tamper(self, job):
        expected = run_whole(job, self.itn, self.work)
        whole, stopped = self.work / (job.output + ".whole"), self.work / (job.output + ".stopped")
        (self.work / job.output).rename(whole)
        begun = stop_on_the_way(job, self.itn, self.work)
        names = job.inputs + [str(p.relative_to(self.work)) for p in begun]
        if self.quick:
            names = job.inputs + [n for n in names[len(job.inputs):] if n.count("/") == 1]
        kinds = {}
        for name in names:
            kinds.setdefault(pathlib.Path(name).suffix, []).append(name)
        (self.work / job.output).rename(stopped)
        for name in dict.fromkeys(names[:16]):
            own = name.startswith(job.output + "/")
            shutil.copytree(stopped, self.work / job.output)
            data = (self.work / name).read_bytes()
            same = kinds[pathlib.Path(name).suffix]
            other = (self.work / same[(same.index(name) + 1) % len(same)]).read_bytes()
            shutil.rmtree(self.work / job.output)
            if not data:
                continue
            for what, changed in changes(data, other, self.quick):
                shutil.copytree(stopped, self.work / job.output)
                (self.work / name).write_bytes(changed)
                code, error = job.run(self.itn, self.work)
                label = f"{job.name}: {name}: {what}"
                self.counts["changes"] += 1
                if code < 0 or code == 4 or "internal error" in error or (code and not error.strip()):
                    self.fail(f"{label}: exit code {code}: {error.strip()[:300]}")
                elif code in (0, 1) and (self.work / job.output).exists() and self.finished(job, error):
                    found = job.contents(self.work)
                    if not own or found.get(name[len(job.output) + 1:]) != expected.get(name[len(job.output) + 1:]) or found != expected:
                        if found != expected:
                            wrong = sorted(n for n in expected if found.get(n) != expected[n])
                            self.fail(f"{label}: another result without a word: {', '.join(wrong)[:200]}")
                    self.counts["as if untouched"] += found == expected
                else:
                    self.counts["refused"] += 1
                if not own:
                    (self.work / name).write_bytes(data)
                shutil.rmtree(self.work / job.output)
        shutil.rmtree(stopped)
        whole.rename(self.work / job.output)
        print(f"{job.name}: {', '.join(f'{n} {what}' for what, n in self.counts.items())}", flush=True)

    @staticmethod
    def finished(job, error):
        """Has the job come to an end of its own? Inversions that have not converged end with 1."""
        return not error.strip() or "not converged" in error

    def alias(self, arguments, outputs, inputs, more=()):
        """outputs: options that name files or folders. inputs: files, among the arguments or named by them."""
        before = {name: (self.work / name).read_bytes() for name in inputs}
        for option in outputs:
            for name in inputs:
                given = [str(self.itn), *arguments, option, name, "--quiet"]
                if option != "-o" and more:
                    given += more
                done = subprocess.run(given, cwd=self.work, capture_output=True, text=True, errors="replace")
                self.counts["aliases"] += 1
                if done.returncode != 2:
                    self.fail(f"{' '.join(given[1:])}: exit code {done.returncode}: {done.stderr.strip()[:200]}")
                for path, data in before.items():
                    if not (self.work / path).is_file() or (self.work / path).read_bytes() != data:
                        self.fail(f"{' '.join(given[1:])}: {path} has changed")
                        if (self.work / path).is_dir():
                            shutil.rmtree(self.work / path)
                        (self.work / path).write_bytes(data)

    def aliases(self):
        scene = ["scene.xml", "skin.xml", "egg.ply", "sky.exr"]
        target = ["--target", "target.exr", "--mask", "mask.exr", "--parameter", "skin.sigma_t"]
        images = scene + ["target.exr", "mask.exr"]
        folder = ["set/manifest.json", "set/images/000003.exr", "set/shapes/egg.ply"]
        self.alias(["render", "scene.xml"], ["-o", "--json"], scene, ["-o", "out.exr"])
        self.alias(["parameters", "scene.xml"], ["--json"], scene)
        self.alias(["gradcheck", "scene.xml"], ["--json"], scene)
        self.alias(["gradient", "scene.xml", *target], ["--json", "-o"], images)
        self.alias(["invert", "scene.xml", *target, "--init", "run/network.safetensors"], ["-o", "--json"],
                   images + ["run/network.safetensors"], ["-o", "out"])
        self.alias(["invert", "scene.xml", *target, "--method", "posterior"], ["-o", "--json", "--renderings"], images, ["-o", "out"])
        self.alias(["view", "scene.xml", "--target", "target.exr"], ["--json"], scene + ["target.exr"])
        self.alias(["dataset", "config.json"], ["-o", "--json"], ["config.json", "egg.ply", "pea.ply"], ["-o", "out"])
        self.alias(["train", "set", "--network", "rn", "--epochs", "1", "--init", "run"], ["-o", "--json", "--export"],
                   folder + ["run/network.safetensors"], ["-o", "out"])
        self.alias(["predict", "run", "set/images/000003.exr", "--dataset", "set"], ["--json"], folder + ["run/network.safetensors"])
        self.alias(["export", "run"], ["-o", "--json"], ["run/network.safetensors"], ["-o", "out.onnx"])
        self.alias(["eval", "set", "run"], ["-o", "--json"], folder + ["run/network.safetensors"], ["-o", "out"])
        print(f"{self.counts['aliases']} outputs that are inputs", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--itn", default=ROOT / "build/bin/itn", type=pathlib.Path)
    parser.add_argument("--parts", default="tamper,alias")
    parser.add_argument("--jobs", help="of tamper; default: all")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    itn, slow = options.itn.resolve(), {"posterior", "eval"} if options.quick else set()
    with tempfile.TemporaryDirectory(prefix="itn_tamper_") as folder:
        work = pathlib.Path(folder)
        matrix, begin = Matrix(itn, work, options.quick), time.monotonic()
        write_inputs(itn, work)
        for job in jobs():
            wanted = options.jobs.split(",") if options.jobs else [j.name for j in jobs() if j.name not in slow]
            if "tamper" in options.parts and job.name in wanted:
                matrix.tamper(job)
            elif job.name in ("dataset", "train"):  # whose results others need
                run_whole(job, itn, work)
        if "alias" in options.parts:
            matrix.aliases()
    print(f"{matrix.counts['changes']} changes, {matrix.counts['aliases']} aliases in {time.monotonic() - begin:.0f} s: {matrix.failures} failures")
    sys.exit(1 if matrix.failures else 0)


main()
