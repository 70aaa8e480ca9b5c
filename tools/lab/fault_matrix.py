#!/usr/bin/env python3
"""Lets the n-th open, read, write, fsync, rename, close, mkdir or operator new of itn fail, n = 1, 2, ... (tests/fault/fault.cpp; only
calls on files of the working folder count, of operator new those of the program itself), and asks each time:

  - exit code 0 with the bytes of an undisturbed run, or one of the contract with a message that is no "internal error";
  - EINTR and reading or writing less than was asked for are no failures;
  - no temporary file is left, and all that the command reads is as it was;
  - the same command then ends with the bytes of an undisturbed run. Where the files that are left are those that another fault left, or
    none, that is known already.

A command calls operator new some thousand times and more: of those from one place in the program, which is where the nearest of its
functions on the stack are the same, the first fails.

  tools/lab/fault_matrix.py [--jobs render,dataset,...] [--calls open,write,...] [--most N] [--stack N] [--short] [--folder DIR]

Exit code 1 where anything else happens. --most: of each call and error so many n, evenly spread (default: all). --stack: how many functions
make a place (default: 2; with 1 it is the call alone).
--short: a handful of n of one command, in seconds."""
import argparse
import errno
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from resumable_jobs import FLOOR, ROOT, contents, egg

LESS = 0  # in the place of an error: less is read or written than was asked for
ERRORS = {
    "open": [errno.EACCES, errno.EMFILE, errno.EIO, errno.ENOSPC, errno.EINTR],
    "read": [errno.EIO, errno.EINTR, LESS],
    "write": [errno.ENOSPC, errno.EIO, errno.EINTR, LESS],
    "fsync": [errno.EIO, errno.ENOSPC, errno.EINTR],
    "rename": [errno.ENOSPC, errno.EIO, errno.EACCES],
    "close": [errno.EIO, errno.EINTR],
    "mkdir": [errno.ENOSPC, errno.EACCES, errno.EIO],
    "new": [errno.ENOMEM],
}
HARMLESS = (errno.EINTR, LESS)
SHORT = {"open": [errno.EMFILE, errno.EINTR], "read": [errno.EIO, LESS], "write": [errno.ENOSPC, LESS], "fsync": [errno.EIO],
         "rename": [errno.EACCES], "close": [errno.EINTR], "new": [errno.ENOMEM]}
FAILED, BAD_INPUT = 1, 3  # exit codes


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", help="of render, gradient, shapes, dataset, train, predict, export, invert, eval [all]")
    parser.add_argument("--calls", default=",".join(ERRORS))
    parser.add_argument("--most", type=int)
    parser.add_argument("--stack", type=int, default=2)
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--itn", default=ROOT / "build/bin/itn", type=pathlib.Path)
    parser.add_argument("--fault", default=ROOT / "build/tests/fault/libitn_fault.so", type=pathlib.Path)
    parser.add_argument("--folder", type=pathlib.Path, help="to work in; default: a temporary one")
    return parser.parse_args()


def jobs_in(inputs, out):
    """Commands by name; they read what is in `inputs` and write into `out`."""
    ball = str(inputs / "ball.xml")
    size = ["--size", "8x6"]
    return {
        "render": ["render", ball, "--spp", "4", *size, "--derivative", "skin.sigma_t", "--preview", "-o", str(out / "a.exr")],
        "gradient": ["gradient", str(inputs / "floor.xml"), "--target", str(inputs / "floor.exr"), "--parameter", "wood.reflectance",
                     "--spp", "8", *size, "-o", str(out), "--json", str(out / "g.json")],
        "shapes": ["shapes", "-o", str(out / "shapes")],
        "dataset": ["dataset", str(inputs / "config.json"), "-o", str(out / "set")],
        "train": ["train", str(inputs / "set"), "--network", "rn", "-o", str(out / "run"), "--epochs", "2", "--batch", "4",
                  "--width", "1", "--checkpoint-every", "0", "--threads", "1", "--export", str(out / "n.safetensors")],
        "predict": ["predict", str(inputs / "run"), str(inputs / "set/images/000000.exr"), "--json",
                    str(out / "p.json")],
        "export": ["export", str(inputs / "run"), "-o", str(out / "n.onnx")],
        "invert": ["invert", ball, "--target", str(inputs / "target.exr"), *size, "--parameter", "skin.sigma_t", "--iterations", "3",
                   "--spp", "8", "--method", "adam", "-o", str(out / "fit")],
        "eval": ["eval", str(inputs / "set"), str(inputs / "run"), "-o", str(out / "report"), "--images", "1", "--inversions", "1",
                 "--iterations", "2", "--threads", "1"],
    }


def sums(folder):
    return {name: s for name, s in contents(folder).items() if pathlib.Path(name).name != ".lock"}


def state(folder):
    """What the next command finds there."""
    return tuple(sorted(str(p.relative_to(folder)) for p in folder.rglob("*"))), tuple(sorted(sums(folder).items()))


def evenly(places, most):
    if not most or len(places) <= most:
        return places
    return [places[(2 * i + 1) * len(places) // (2 * most)] for i in range(most)]


class Undisturbed:
    """A command's whole run: sums of the outputs that are the same in two of them, exit code, message, and the calls: of each how many,
    and the places of operator new, the first call of each by its place's key."""

    def __init__(self, kept, code, message, counted):
        self.kept, self.code, self.message = kept, code, message
        rows = [line.split() for line in counted.splitlines()]
        self.counts = {row[0]: int(row[1]) for row in rows if row[0] != "site"}
        self.sites = {row[1]: int(row[2]) for row in rows if row[0] == "site"}

    def places(self, call):
        return sorted(self.sites.values()) if call == "new" else list(range(1, self.counts[call] + 1))


class Matrix:
    def __init__(self, options, work):
        self.itn, self.fault, self.work = str(options.itn.resolve()), str(options.fault.resolve()), work
        self.inputs, self.out = work / "inputs", work / "out"
        self.stack, self.short = options.stack, options.short
        self.counts = work.parent / (work.name + ".counts")
        self.failures = self.faults = 0

    def itn_with(self, command, call="", at=0, error=0, preloaded=True):
        """Exit code and message."""
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        if preloaded:
            environment |= {"LD_PRELOAD": self.fault, "ITN_FAULT_FOLDER": str(self.work), "ITN_FAULT_CALL": call,
                            "ITN_FAULT_AT": str(at), "ITN_FAULT_ERROR": str(error), "ITN_FAULT_COUNT": str(self.counts),
                            "ITN_FAULT_STACK": str(self.stack)}
        done = subprocess.run([self.itn, *command, "--quiet"] if "--quiet" not in command else [self.itn, *command],
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=environment, cwd=self.work, timeout=600)
        return done.returncode, done.stderr.decode(errors="replace")

    def counted(self):
        """What the library has written."""
        text = self.counts.read_text() if self.counts.exists() else ""
        self.counts.unlink(missing_ok=True)
        return text

    def whole(self, command):
        code, message = self.itn_with(command, preloaded=False)
        if code != 0:
            sys.exit(f"{' '.join(command)}: exit code {code} undisturbed: {message}")

    def prepare(self, jobs):
        """What the commands read."""
        self.inputs.mkdir(parents=True)
        (self.inputs / "ball.xml").write_text((ROOT / "tests/tool/data/ball.xml").read_text())
        for name in ("egg", "pea"):
            (self.inputs / f"{name}.ply").write_text(egg())
        side = {"shapes": ["egg.ply"], "azimuths": [0], "materials": 10}
        (self.inputs / "config.json").write_text(json.dumps(
            {"preset": "tiny", "size": 8, "spp": 4, "train": side, "test": {"shapes": ["pea.ply"], "azimuths": [30], "materials": 2}}))
        (self.inputs / "floor.xml").write_text(FLOOR)
        shutil.copy(ROOT / "scenes/test/uniform.exr", self.inputs / "sky.exr")
        (self.inputs / "wood.ppm").write_bytes(b"P6 2 2 255\n" + bytes(range(40, 160, 10)))
        for job, scene, target in (("gradient", "floor", "floor"), ("invert", "ball", "target")):
            if job in jobs:
                self.whole(["render", str(self.inputs / f"{scene}.xml"), "--size", "8x6", "--spp", "256",
                            "-o", str(self.inputs / f"{target}.exr")])
        if {"train", "predict", "export", "eval"} & set(jobs):
            self.whole(["dataset", str(self.inputs / "config.json"), "-o", str(self.inputs / "set")])
        if {"predict", "export", "eval"} & set(jobs):
            self.whole(["train", str(self.inputs / "set"), "--network", "rn", "-o", str(self.inputs / "run"), "--epochs", "1", "--batch",
                        "4", "--width", "1"])

    def clean(self):
        shutil.rmtree(self.out, ignore_errors=True)
        self.out.mkdir()

    def undisturbed(self, command):
        found = []
        for counting in (False, True):
            self.clean()
            code, message = self.itn_with(command, preloaded=counting)
            if code not in (0, FAILED):
                sys.exit(f"{' '.join(command)}: exit code {code} undisturbed: {message}")
            found.append(sums(self.out))
        kept = {name: s for name, s in found[0].items() if found[1].get(name) == s}
        if not kept:
            sys.exit(f"{' '.join(command)}: two whole runs differ: nothing to compare with")
        return Undisturbed(kept, code, message, self.counted())

    def differences(self, kept):
        found = sums(self.out)
        return [name for name in kept if found.get(name) != kept[name]]

    def left_behind(self):
        return [str(f.relative_to(self.work)) for f in self.work.rglob("*.tmp-*")]

    def gone_on_from(self, command, whole):
        """What is wrong where the same command is called again."""
        code, message = self.itn_with(command, preloaded=False)
        wrong = [f"the same command then: exit code {code}: {message.strip()}"] if code != whole.code else []
        wrong += [f"{name} differs after the same command again" for name in self.differences(whole.kept)]
        return wrong + [f"then left behind: {f}" for f in self.left_behind()]

    def try_fault(self, job, command, call, n, error, whole, seen):
        """The place of operator new that has failed. seen: states of the output folder from which the command has gone on."""
        before = sums(self.inputs)
        self.clean()
        self.faults += 1
        code, message = self.itn_with(command, call, n, error)
        failed = self.counted().removeprefix("failed").strip()
        wrong = []
        succeeded = code == whole.code and message == whole.message
        if succeeded:
            wrong += [f"{name} differs from an undisturbed run" for name in self.differences(whole.kept)]
        elif error in HARMLESS:
            wrong.append(f"exit code {code} for what is no failure: {message.strip()}")
        elif code not in (FAILED, BAD_INPUT):
            wrong.append(f"exit code {code}: {message.strip()}")
        elif not message.startswith("itn: ") and "\nitn: " not in message or "internal error" in message:
            wrong.append(f"message: {message.strip()}")
        wrong += [f"left behind: {f}" for f in self.left_behind()]
        if sums(self.inputs) != before:
            wrong.append("the inputs have changed")
        if not succeeded and (now := state(self.out)) not in seen:
            seen.add(now)
            wrong += self.gone_on_from(command, whole)
        for text in wrong:
            self.failures += 1
            name = errno.errorcode.get(error, "less")
            print(f"{job}: {call} {n} fails with {name}: {text[:600]}", flush=True)
        return failed

    def run(self, job, command, errors, most):
        begin = time.monotonic()
        whole = self.undisturbed(command)
        self.clean()
        seen, faults, tried, failed = {state(self.out)}, self.faults, [], set()
        for call in errors:
            places = whole.places(call)
            # Of a few the last place: there JSON is destroyed, out of which no exception comes.
            places = places[-1:] if self.short and call == "new" else evenly(places, most)
            for error in errors[call]:
                for n in places:
                    failed.add(self.try_fault(job, command, call, n, error, whole, seen))
            tried.append(f"{call} {len(places)} of {whole.counts[call]}")
            if call == "new":
                tried[-1] += f", {len(failed & whole.sites.keys())} of {len(whole.sites)} places"
        print(f"{job}: {self.faults - faults} faults ({', '.join(tried)}), gone on from {len(seen) - 1} states, in "
              f"{time.monotonic() - begin:.0f} s", flush=True)


def main():
    options = arguments()
    work = (options.folder or pathlib.Path(tempfile.mkdtemp(prefix="itn_faults_"))).resolve()
    work.mkdir(parents=True, exist_ok=True)
    matrix = Matrix(options, work)
    jobs = jobs_in(matrix.inputs, matrix.out)
    names = options.jobs.split(",") if options.jobs else ["render"] if options.short else list(jobs)
    matrix.prepare(names)
    errors = {call: (SHORT if options.short else ERRORS)[call] for call in options.calls.split(",") if call in SHORT or not options.short}
    for name in names:
        matrix.run(name, jobs[name], errors, 1 if options.short else options.most)
    print(f"{matrix.faults} faults, {matrix.failures} findings")
    if not options.folder:
        shutil.rmtree(work)
    sys.exit(matrix.failures > 0)


main()
