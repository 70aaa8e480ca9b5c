#!/usr/bin/env python3
"""How soon `itn view` shows its first picture, and how soon it answers a slider.

view_bench.py [SCENE] [--itn PATH] [--size WxH] [--moves N] [--target PHOTO.exr]

Talks to the server as the page does. The first picture is timed from the start of the process, with the programs in the
driver's cache (the first of the runs fills it); the answer to a slider from the request that says its new value to the
last byte of the first frame with that value, alone and while another slider's value is still being rendered.
"""
import argparse
import random
import statistics
import time
from pathlib import Path

from view_client import View

ROOT = Path(__file__).resolve().parents[2]


def moves(view, parameter, count, derivative=""):
    view.tell("/look", {"derivative": derivative})
    after, numbers = 0, {}
    deadline = time.perf_counter() + 60
    while derivative and not numbers.get("derivative") and time.perf_counter() < deadline:
        numbers, _ = view.frame(after)
        after = numbers["number"]
    value, times, samples = parameter["value"], [], []
    for _ in range(count):
        time.sleep(0.2 + random.random())
        target = value * (0.7 + 0.6 * random.random())
        start = time.perf_counter()
        revision = view.tell("/set", {parameter["name"]: target})["revision"]
        numbers = view.picture_of(revision)
        times.append(1e3 * (time.perf_counter() - start))
        samples.append(numbers["spp"])
    times.sort()
    print(f"{parameter['name']}{', with its derivative' if derivative else ''}: {count} moves answered in "
          f"{statistics.median(times):.0f} ms (median), {times[int(0.95 * count)]:.0f} ms (95 %), {times[-1]:.0f} ms "
          f"(longest), with {min(samples)} to {max(samples)} samples a pixel")


def drag(view, parameter, seconds=3):
    value, pictures, late = parameter["value"], 0, []
    after = view.frame()[0]["number"]
    sent, start = {}, time.perf_counter()
    k = 0
    while time.perf_counter() - start < seconds:
        k += 1
        revision = view.tell("/set", {parameter["name"]: value * (0.5 + 0.001 * (k % 1000))})["revision"]
        sent[revision] = time.perf_counter()
        numbers, _ = view.frame(after)
        after = numbers["number"]
        if numbers["revision"] in sent:
            late.append(1e3 * (time.perf_counter() - sent[numbers["revision"]]))
        pictures += 1
    print(f"{parameter['name']}, dragged: {pictures / seconds:.0f} pictures a second, {statistics.median(late):.0f} ms "
          f"behind the slider")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default=str(ROOT / "docs/tutorials/wax.xml"))
    parser.add_argument("--itn", default=str(ROOT / "build/bin/itn"))
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--moves", type=int, default=40)
    parser.add_argument("--target")
    options = parser.parse_args()
    random.seed(0)
    arguments = [options.scene, "--size", options.size, *(["--target", options.target] if options.target else [])]
    with View(options.itn, arguments) as view:
        view.first_picture()
    first = []
    for _ in range(5):
        with View(options.itn, arguments) as view:
            first.append(view.first_picture()[0])
    print(f"{Path(options.scene).name} at {options.size}: first picture after {min(first):.2f} to {max(first):.2f} s, five starts")
    with View(options.itn, arguments) as view:
        view.first_picture()
        parameters = [p for p in view.ask_json("/parameters")["parameters"] if p["value"] and not p["not_differentiable"]]
        if options.target:  # moves then meet steps of Gauss-Newton
            after, numbers = 0, {}
            while "step" not in numbers:
                numbers, _ = view.frame(after)
                after = numbers["number"]
        moves(view, parameters[0], options.moves)
        moves(view, parameters[0], options.moves, parameters[0]["name"])
        view.tell("/look", {"derivative": ""})
        drag(view, parameters[0])


if __name__ == "__main__":
    main()
