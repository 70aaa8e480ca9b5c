#!/usr/bin/env python3
"""What Python costs: python_bench.py [overhead | memory [RENDERS] | threads [RENDERS] | itn [STEPS] | itn-sun [STEPS]]...

overhead  time of a call beside the renderer's own, of small images, and beside the command
memory    resident memory and time of a render over many renders
threads   renders a second of several threads with scenes of their own, which share one device; memory; the same images
itn       a step of training an inverse transport network in PyTorch, rendering by itn and by Mitsuba, and how much longer Mitsuba's takes
          to gradients of the same noise, under constant light; needs torch and mitsuba
itn-sun   the same under sun and sky
"""
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import itn

ROOT = Path(__file__).resolve().parents[2]
BALL = str(ROOT / "tests/tool/data/ball.xml")


def overhead():
    scene = itn.load(BALL)
    itn.render(scene, spp=1)
    rows = []
    for seed in range(300):
        start = time.perf_counter()
        result = itn.render(scene, spp=1, seed=seed)
        rows.append((time.perf_counter() - start, result.render_s))
    call, own = (statistics.median(column) for column in zip(*rows))
    print(f"32 x 24 pixels, 1 spp: a call takes {1e3 * call:.3f} ms, of which tracing {1e3 * own:.3f} ms: "
          f"{1e3 * (call - own):.3f} ms beside it")
    program = ROOT / "build/bin/itn"
    start = time.perf_counter()
    subprocess.run([program, "render", BALL, "-o", "/dev/shm/bench.exr", "--spp", "1", "--quiet"], check=True)
    print(f"the command as a process: {1e3 * (time.perf_counter() - start):.0f} ms")


def resident():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def memory(renders=10000):
    scene = itn.load(BALL)
    times = []
    for k in range(renders):
        scene.parameters["skin.sigma_t"] = 5 + 5 * k / renders
        start = time.perf_counter()
        itn.render(scene, spp=1, seed=k)
        times.append(time.perf_counter() - start)
        if k in (99, renders // 2, renders - 1):
            print(f"after {k + 1} renders: {resident():.1f} MiB, the last hundred took "
                  f"{1e3 * statistics.median(times[-100:]):.3f} ms each")


def threads(renders=2000):
    import threading

    def images(scene, count, first):
        for k in range(count):
            scene.parameters["skin.sigma_t"] = 5 + (first + k) % 7
            yield itn.render(scene, spp=1, seed=first + k).image

    def sums(scene, count, first, into):
        into.extend(float(image.sum(dtype=np.float64)) for image in images(scene, count, first))

    alone = []
    sums(itn.load(BALL), renders, 0, alone)
    for workers in (1, 2, 4, 8):
        parts = [[] for _ in range(workers)]
        share = renders // workers
        scenes = [itn.load(BALL) for _ in range(workers)]
        for scene in scenes:
            itn.render(scene, spp=1)  # makes its renderer
        start = time.perf_counter()
        started = [threading.Thread(target=sums, args=(scenes[w], share, w * share, parts[w])) for w in range(workers)]
        for thread in started:
            thread.start()
        for thread in started:
            thread.join()
        seconds = time.perf_counter() - start
        together = [value for part in parts for value in part]
        same = together == alone[:len(together)]
        print(f"{workers} threads: {len(together) / seconds:.0f} renders a second, the {'same' if same else 'WRONG'} images, "
              f"{resident():.1f} MiB")


SUN = """<emitter type="sunsky"><vector name="sun_direction" x="0.3" y="-0.5" z="0.8"/><float name="turbidity" value="3"/></emitter>"""


def train_in_sun(steps=20):
    train(steps, sun=True)


def train(steps=20, batch=8, spp=16, sun=False):
    import torch
    import itn.torch
    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")
    import drjit as dr

    rng = np.random.default_rng(0)
    low, high = np.array([4.0, 0.6]), np.array([12.0, 0.95])
    truth = torch.from_numpy(low + (high - low) * rng.random((batch, 2))).float()
    text = Path(BALL).read_text(encoding="utf-8").replace('value="32"', 'value="64"').replace('value="24"', 'value="64"')
    if sun:
        text = re.sub("<emitter.*</emitter>", SUN, text, flags=re.DOTALL)
    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write(text)
        file.flush()
        scene = itn.load(file.name)
    names = ("skin.sigma_t", "skin.albedo")
    photos = itn.torch.render(scene, dict(zip(names, truth.T)), spp=256, seed=1000)
    targets = [itn.torch.target(scene, photo) for photo in photos]

    theirs = mi.load_string(text, spp=spp)
    parameters = mi.traverse(theirs)
    integrator = mi.load_dict({"type": "prbvolpath", "max_depth": 64})
    keys = [next(k for k in parameters.keys() if k.endswith(f"medium.{name}.value.value")) for name in ("sigma_t", "albedo")]

    def network():
        torch.manual_seed(0)
        layers, channels = [], 3
        for out in (16, 32, 64, 128):
            layers += [torch.nn.Conv2d(channels, out, 3, 2, 1), torch.nn.ReLU()]
            channels = out
        return torch.nn.Sequential(*layers, torch.nn.Flatten(), torch.nn.Linear(128 * 16, 2))

    def values(raw):
        return torch.from_numpy(low).float() + torch.from_numpy(high - low).float() * torch.sigmoid(raw)

    # Each: of guesses (images, 2) the mean loss and its gradient by them.
    def ours(guess, step):
        guess = guess.detach().requires_grad_()
        loss = itn.torch.image_loss(scene, dict(zip(names, guess.T)), targets, spp=spp, seed=step * batch).mean()
        loss.backward()
        return loss.item(), guess.grad

    wanted = [mi.TensorXf(photo.numpy()) for photo in photos]

    def mitsuba(guess, step):
        total, gradient = 0.0, torch.zeros(batch, 2)
        for k in range(batch):
            numbers = [mi.Float(float(x)) for x in guess[k].detach()]
            for number in numbers:
                dr.enable_grad(number)
            parameters[keys[0]] = numbers[0]
            parameters[keys[1]] = mi.Color3f(numbers[1])
            parameters.update()
            seed = step * batch + k
            image = mi.render(theirs, parameters, integrator=integrator, spp=spp, spp_grad=spp, seed=seed,
                              seed_grad=seed + 7777777)
            loss = dr.mean(dr.square(image - wanted[k]), axis=None)
            dr.backward(loss)
            total += loss.array[0] / batch
            gradient[k] = torch.tensor([dr.grad(number)[0] / batch for number in numbers])
        return total, gradient

    guess = truth + 0.1 * (torch.from_numpy(high - low).float())
    seeds, work = 32, []  # work: variance of the gradient, then times the time of a step
    for name, loss in (("itn", ours), ("mitsuba", mitsuba)):
        gradients = []
        for seed in range(seeds):
            gradients.append(loss(guess, 100 + seed)[1].numpy().sum(0))
        mean, error = np.mean(gradients, 0), np.std(gradients, 0, ddof=1) / np.sqrt(seeds)
        work.append(error ** 2)
        print(f"{name}: gradient by sigma_t {mean[0]:.6f} +- {error[0]:.6f}, by albedo {mean[1]:.5f} +- {error[1]:.5f}")
    for k, (name, loss) in enumerate((("itn", ours), ("mitsuba", mitsuba))):
        net = network()
        adam = torch.optim.Adam(net.parameters(), 1e-3)
        times, losses = [], []
        start = time.perf_counter()
        for step in range(steps):
            begin = time.perf_counter()
            adam.zero_grad()
            guess = values(net(torch.log(photos.permute(0, 3, 1, 2) + 0.01)))
            total, gradient = loss(guess, step)
            guess.backward(gradient)
            adam.step()
            times.append(time.perf_counter() - begin)
            losses.append(total)
        work[k] = work[k] * statistics.median(times)
        print(f"{name}: {batch} images of 64 x 64, {spp} spp: a step {1e3 * statistics.median(times):.0f} ms, the first "
              f"{times[0]:.2f} s, {steps} steps {time.perf_counter() - start:.1f} s, loss {losses[0]:.5f} to {losses[-1]:.5f}")
    sigma_t, albedo = work[1] / work[0]
    print(f"to the same noise of the gradient Mitsuba takes {sigma_t:.3g} (by sigma_t) and {albedo:.3g} times (albedo) as long")


def main():
    arguments = sys.argv[1:] or ["overhead", "memory"]
    runs = {"overhead": overhead, "memory": memory, "threads": threads, "itn": train, "itn-sun": train_in_sun}
    while arguments:
        name = arguments.pop(0)
        if name not in runs:
            sys.exit(__doc__)
        runs[name](*([int(arguments.pop(0))] if arguments and arguments[0].isdigit() else []))


if __name__ == "__main__":
    main()
