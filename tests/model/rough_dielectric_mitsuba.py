"""Prints rough_dielectric_mitsuba.inc: python3 rough_dielectric_mitsuba.py > rough_dielectric_mitsuba.inc

Needs the mitsuba package (made with 3.9.1)."""
import math
import random

import mitsuba as mi

mi.set_variant("scalar_rgb")
random.seed(7)
context = mi.BSDFContext()
for distribution, name in enumerate(["beckmann", "ggx"]):
    for alpha in [0.05, 0.1, 0.3, 1.0]:
        for side in [1, -1]:
            for case, cosine in enumerate([0.95, 0.5, 0.2, 0.7]):
                n = [1.33, 1.5][case % 2]
                bsdf = mi.load_dict({"type": "roughdielectric", "distribution": name, "alpha": alpha,
                                     "int_ior": n, "ext_ior": 1.0})
                azimuth, sine = random.uniform(0, 2 * math.pi), math.sqrt(1 - cosine * cosine)
                si = mi.SurfaceInteraction3f()
                si.wi = mi.Vector3f(sine * math.cos(azimuth), sine * math.sin(azimuth), side * cosine)
                for attempt in range(3000):  # the first two cases reflect, the others transmit where they can
                    sample, weight = bsdf.sample(context, si, random.random(),
                                                 mi.Point2f(random.random(), random.random()))
                    wanted = (sample.wo.z * si.wi.z > 0) == (case < 2) or attempt > 2000
                    if weight[0] > 0 and sample.pdf > 1e-3 and wanted:
                        break
                wi, wo = si.wi, sample.wo
                print("    {%d, %g, %g, {%.8f, %.8f, %.8f}, {%.8f, %.8f, %.8f}, %.7g, %.7g}," %
                      (distribution, alpha, n, wi.x, wi.y, wi.z, wo.x, wo.y, wo.z,
                       bsdf.eval(context, si, wo)[0], bsdf.pdf(context, si, wo)))
