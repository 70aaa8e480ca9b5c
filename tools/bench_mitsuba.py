"""The other side of `itn bench --peer mitsuba`: renders scene files in Mitsuba 3 when asked.

One JSON object a line on standard input, {"scene": FILE, "spp": N, "seed": K, "output": FILE}; one answer a line on
standard output, {"seconds": T, "width": W, "height": H}, the image as raw float32 RGB in the output file.
Seconds are path tracing alone: the scene is loaded before, once; the caller throws the first run (kernel compilation) away.
"""
import json
import os
import sys
import time

# Whatever Mitsuba prints must not mix with the answers.
answers = os.fdopen(os.dup(1), 'w')
os.dup2(2, 1)


def main():
    import drjit as dr
    import mitsuba as mi
    import numpy as np

    mi.set_variant('llvm_ad_rgb')
    mi.set_log_level(mi.LogLevel.Error)
    print(json.dumps({'mitsuba': mi.__version__, 'variant': mi.variant()}), file=answers, flush=True)
    scene, loaded = None, None
    for line in sys.stdin:
        job = json.loads(line)
        if job['scene'] != loaded:
            scene, loaded = mi.load_file(job['scene']), job['scene']
        dr.sync_thread()
        start = time.perf_counter()
        image = mi.render(scene, spp=job['spp'], seed=job['seed'])
        dr.eval(image)
        dr.sync_thread()
        seconds = time.perf_counter() - start
        pixels = np.array(image, dtype=np.float32)
        pixels.tofile(job['output'])
        print(json.dumps({'seconds': seconds, 'width': pixels.shape[1], 'height': pixels.shape[0]}),
              file=answers, flush=True)


if __name__ == '__main__':
    main()
