"""Training images/s of itn's network beside PyTorch's, same layers, batch 32, six channels, on the same cores in turns.

python tests/network/training_pytorch.py build/bin/test_network [--threads N] [--runs N]

with a Python that has torch (tools/peers --training). A step is forward, loss, backward and Adam; a run's figure is its
best of eleven steps, and the table has the medians of the runs: wall time, and user time of all threads.
"""
import argparse
import os
import resource
import statistics
import subprocess
import sys
import time

BATCH = 32


def network(size):
    import torch

    layers, channels_in, channels = [], 6, 16
    for _ in range(7):
        layers += [torch.nn.Conv2d(channels_in, channels, 3, padding=1), torch.nn.ReLU(inplace=True)]
        if size > 1:
            layers.append(torch.nn.MaxPool2d(2))
            size //= 2
        channels_in, channels = channels, 2 * channels
    return torch.nn.Sequential(*layers, torch.nn.Flatten(), torch.nn.Linear(1024, 3))


def pytorch(size, channels_last, threads):
    """Prints what test_network '[bench]' prints: size, wall seconds a step, user seconds a step."""
    import torch

    torch.set_num_threads(threads)
    torch.manual_seed(1)
    net, images, truth = network(size), torch.rand(BATCH, 6, size, size), torch.rand(BATCH, 3)
    if channels_last:
        net = net.to(memory_format=torch.channels_last)
        images = images.to(memory_format=torch.channels_last)
    adam = torch.optim.Adam(net.parameters(), lr=1e-4)
    best_wall = best_user = float("inf")
    for step in range(12):
        wall, user = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_utime
        adam.zero_grad()
        ((torch.sigmoid(net(images)) - truth) ** 2).mean().backward()
        adam.step()
        if step > 0:
            best_wall = min(best_wall, time.perf_counter() - wall)
            best_user = min(best_user, resource.getrusage(resource.RUSAGE_SELF).ru_utime - user)
    print(f"{size} {best_wall:.4f} {best_user:.4f}")


def times(command, threads):
    output = subprocess.run(command, env={**os.environ, "OMP_NUM_THREADS": str(threads)}, capture_output=True, text=True,
                            check=True).stdout
    return next(tuple(map(float, line.split()[1:])) for line in output.splitlines() if line[:1].isdigit())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary", nargs="?", help="test_network")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--pytorch", nargs=2, metavar=("SIZE", "LAYOUT"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.pytorch:
        pytorch(int(options.pytorch[0]), options.pytorch[1] == "channels_last", options.threads)
        return
    if not options.binary:
        parser.error("where is test_network?")

    print("size  who                     wall ms   images/s   user ms")
    for size in (128, 64):
        itself = [sys.executable, __file__, "--threads", str(options.threads), "--pytorch", str(size)]
        commands = {
            "itn": [options.binary, f"Training steps of {BATCH} images of {size}x{size}x6"],
            "PyTorch": [*itself, "contiguous"],
            "PyTorch, channels last": [*itself, "channels_last"],
        }
        runs = {who: [] for who in commands}
        for _ in range(options.runs):
            for who, command in commands.items():
                runs[who].append(times(command, options.threads))
        for who, found in runs.items():
            wall, user = (statistics.median(column) for column in zip(*found))
            print(f"{size:4}  {who:22}  {1000 * wall:7.1f}  {BATCH / wall:9.0f}  {1000 * user:8.1f}")


main()
