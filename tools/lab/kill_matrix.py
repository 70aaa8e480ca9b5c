#!/usr/bin/env python3
"""Kills itn with SIGKILL at random moments, again and again, until the job is done, and compares the files with those of a job that
was never killed: data sets, trainings, inversions by all three methods and of textures, evaluations. Files that kills have left count, too.

  tools/lab/kill_matrix.py [--kills N] [--jobs dataset,train,...] [--itn build/bin/itn] [--folder DIR]

Exit code 1 where anything differs or is left. Jobs take some tenths of a second of processor time, so that a thousand kills take
a quarter of an hour on an idle machine. Moments are uniform over the time that the last job took."""
import argparse
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time

from resumable_jobs import ROOT, jobs, run_whole, write_inputs

IN_A_ROW = 12  # kills, after which a job is left to come to its end


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [job.name for job in jobs()]
    parser.add_argument("--kills", type=int, default=1000, help="in all [1000]")
    parser.add_argument("--jobs", default=",".join(names), help=f"of {', '.join(names)}")
    parser.add_argument("--itn", default=ROOT / "build/bin/itn", type=pathlib.Path)
    parser.add_argument("--folder", type=pathlib.Path, help="to work in; default: a temporary one")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def kill_until_done(job, itn, work, seconds, moments):
    """Returns how often it was killed before it was done, and how long the last start took."""
    for kills in range(IN_A_ROW + 1):
        begin = time.monotonic()
        process = job.start(itn, work)
        try:
            error = process.communicate(timeout=moments.uniform(0, seconds) if kills < IN_A_ROW else None)[1]
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            continue
        if process.returncode not in (0, 1):
            sys.exit(f"{job.name}: after {kills} kills exit code {process.returncode}: {error.decode(errors='replace')}")
        return kills, time.monotonic() - begin


def differences(expected, found):
    for name in sorted(set(expected) | set(found)):
        if name not in expected:
            yield f"{name} is left behind"
        elif name not in found:
            yield f"{name} is missing"
        elif expected[name] != found[name]:
            yield f"{name} differs"


def main():
    options = arguments()
    work = options.folder or pathlib.Path(tempfile.mkdtemp(prefix="itn_kills_"))
    work.mkdir(parents=True, exist_ok=True)
    itn = options.itn.resolve()
    write_inputs(itn, work)
    moments = random.Random(options.seed)
    chosen = options.jobs.split(",")
    failed, total, begin = False, 0, time.monotonic()
    for job in jobs():
        expected = run_whole(job, itn, work)
        if job.name not in chosen:
            continue
        whole = work / (job.output + ".whole")
        shutil.rmtree(whole, ignore_errors=True)
        (work / job.output).rename(whole)
        start = time.monotonic()
        again = run_whole(job, itn, work)  # compiled kernels are there now
        seconds = time.monotonic() - start
        if again != expected:
            sys.exit(f"{job.name}: two whole runs differ: {', '.join(differences(expected, again))}")
        kills = rounds = 0
        while kills < options.kills / len(chosen):
            shutil.rmtree(work / job.output)
            more, last = kill_until_done(job, itn, work, seconds, moments)
            seconds = last if more == 0 else seconds  # of a whole job
            kills += more
            rounds += 1
            for text in differences(expected, job.contents(work)):
                failed = True
                print(f"{job.name}: {text} after {more} kills", flush=True)
        total += kills
        print(f"{job.name}: {kills} kills in {rounds} jobs of {seconds:.1f} s", flush=True)
        shutil.rmtree(work / job.output)  # others need what was never killed
        whole.rename(work / job.output)
    print(f"{total} kills in {time.monotonic() - begin:.0f} s: {'FAILED' if failed else 'all files as if never killed'}")
    if not options.folder:
        shutil.rmtree(work)
    sys.exit(failed)


main()
