"""Prints bsdfs_mitsuba.inc: python3 bsdfs_mitsuba.py > bsdfs_mitsuba.inc

Needs the mitsuba package (made with 3.9.1). Rows: type, variant, the values of all parameters in the order of the model's
declaration, wi, wo, the value in each channel, and the density; or -1 and the share of the light from a chosen direction."""
import math
import random

import mitsuba as mi

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)
random.seed(11)
CONTEXT = mi.BSDFContext()
DISTRIBUTIONS = ["beckmann", "ggx"]


def listed(values):
    return "{%s}" % ", ".join("%.8g" % v for v in values)


def interaction(cosine, azimuth):
    sine = math.sqrt(1 - cosine * cosine)
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(sine * math.cos(azimuth), sine * math.sin(azimuth), cosine)
    return si


def row(kind, variant, slots, si, wo, value, pdf):
    print('    {"%s", %d, %s, %s, %s, %s, %.7g},' % (kind, variant, listed(slots), listed(si.wi), listed(wo),
                                                      listed(value), pdf))


def drawn(kind, variant, slots, bsdf, cosines=(0.97, 0.6, 0.25, 0.08)):
    """Four directions of incidence, each with one sample of the BSDF itself and one anywhere."""
    for cosine in cosines:
        si = interaction(cosine, random.uniform(0, 2 * math.pi))
        while True:
            sample, weight = bsdf.sample(CONTEXT, si, random.random(), mi.Point2f(random.random(), random.random()))
            if weight[0] > 0 and sample.pdf > 1e-3 and abs(sample.wo.z) > 0.02 and bsdf.pdf(CONTEXT, si, sample.wo) > 0:
                break
        anywhere = interaction(random.uniform(0.05, 1), random.uniform(0, 2 * math.pi)).wi
        for wo in (sample.wo, anywhere):
            if bsdf.pdf(CONTEXT, si, wo) == 0:
                continue  # below 1e-20, which Mitsuba makes 0
            row(kind, variant, slots, si, wo, bsdf.eval(CONTEXT, si, wo), bsdf.pdf(CONTEXT, si, wo))


def chosen(kind, slots, bsdf, cosines=(0.97, 0.6, 0.25, 0.08)):
    for cosine in cosines:
        si = interaction(cosine, random.uniform(0, 2 * math.pi))
        for u in (1e-4, 0.9999):  # the first and the last of the choices
            sample, weight = bsdf.sample(CONTEXT, si, u, mi.Point2f(0.5, 0.5))
            if bsdf.pdf(CONTEXT, si, sample.wo) > 0 and u > 0.5:
                continue  # the base of a plastic
            row(kind, 0, slots, si, sample.wo, [w * sample.pdf for w in weight], -1)


def principled():
    """Sets of random parameters, each from above and, where light passes, from below."""
    common = ["roughness", "anisotropic", "spec_tint", "sheen", "sheen_tint", "flatness"]
    rates = ["main_specular", "clearcoat", "diffuse_reflectance"]
    thin_rates = ["specular_reflectance", "specular_transmittance", "diffuse_reflectance", "diffuse_transmittance"]
    models = (("principled", common + ["metallic", "clearcoat", "clearcoat_gloss"], rates, False),
              ("principled", common + ["metallic", "spec_trans", "clearcoat", "clearcoat_gloss"], rates, True),
              ("principledthin", common + ["spec_trans", "diff_trans"], thin_rates, True))
    for kind, names, of_rates, passes in models:
        for number in range(10):
            colour = [random.random() for _ in range(3)]
            values = {name: random.random() for name in names}
            values["roughness"] = random.uniform(0.2, 1)
            if "clearcoat_gloss" in values:
                values["clearcoat_gloss"] *= 0.5  # beyond, Mitsuba's single precision loses digits
            if "diff_trans" in values:
                values["diff_trans"] *= 2
            values["eta"] = random.uniform(1.1, 2.2) if number % 3 else random.uniform(0.4, 0.9)
            values.update({"%s_sampling_rate" % rate: random.uniform(0.5, 2) for rate in of_rates})
            bsdf = mi.load_dict({"type": kind, "base_color": {"type": "rgb", "value": colour}, **values})
            slots = colour + list(values.values())
            for cosine in (0.97, 0.6, 0.25, 0.08) + ((-0.9, -0.3) if passes else ()):
                si = interaction(cosine, random.uniform(0, 2 * math.pi))
                for side in (1, -1) if passes else (1,):
                    wo = interaction(side * random.uniform(0.05, 1), random.uniform(0, 2 * math.pi)).wi
                    if bsdf.pdf(CONTEXT, si, wo) > 1e-4 and bsdf.eval(CONTEXT, si, wo)[0] > 1e-4:
                        row(kind, 0, slots, si, wo, bsdf.eval(CONTEXT, si, wo), bsdf.pdf(CONTEXT, si, wo))
                sample, weight = bsdf.sample(CONTEXT, si, random.random(), mi.Point2f(random.random(), random.random()))
                if weight[0] > 0 and sample.pdf > 1e-3:
                    row(kind, 0, slots, si, sample.wo, bsdf.eval(CONTEXT, si, sample.wo), sample.pdf)


def main():
    diffuse, specular = [0.7, 0.4, 0.1], [1, 0.9, 0.6]
    plain = {"diffuse_reflectance": {"type": "rgb", "value": diffuse},
             "specular_reflectance": {"type": "rgb", "value": specular}, "ext_ior": 1.0}
    for nonlinear, ior in ((0, 1.3), (0, 1.49), (1, 1.49), (0, 1.9)):
        slots = diffuse + specular + [ior, 1, nonlinear]
        bsdf = mi.load_dict({"type": "plastic", "int_ior": ior, "nonlinear": bool(nonlinear), **plain})
        drawn("plastic", 0, slots, bsdf)
        chosen("plastic", slots, bsdf)
        for variant, name in enumerate(DISTRIBUTIONS):
            for alpha in (0.02, 0.1, 0.3, 0.8):
                slots = diffuse + specular + [alpha, ior, 1, nonlinear]
                drawn("roughplastic", variant, slots,
                      mi.load_dict({"type": "roughplastic", "distribution": name, "alpha": alpha, "int_ior": ior,
                                    "nonlinear": bool(nonlinear), **plain}))
    for variant, name in enumerate(DISTRIBUTIONS):
        for alpha in (0.05, 0.3):
            slots = diffuse + specular + [alpha, 1.49, 1]
            drawn("pplastic", variant, slots,
                  mi.load_dict({"type": "pplastic", "distribution": name, "alpha": alpha, "int_ior": 1.49, **plain}))
    eta, k = [0.2, 1.1, 2.7], [3.9, 2.4, 0.3]
    tints = {"specular_reflectance": {"type": "rgb", "value": specular}}
    chosen("conductor", specular + eta + k,
           mi.load_dict({"type": "conductor", "eta": {"type": "rgb", "value": eta}, "k": {"type": "rgb", "value": k}, **tints}))
    tints["specular_transmittance"] = {"type": "rgb", "value": diffuse}
    for ior in (1.2, 1.5046, 0.7):
        chosen("thindielectric", specular + diffuse + [ior, 1],
               mi.load_dict({"type": "thindielectric", "int_ior": ior, "ext_ior": 1.0, **tints}),
               (0.97, -0.6, 0.25, -0.08))

    index = {name: {"type": "rgb", "value": value} for name, value in (("eta", eta), ("k", k))}
    rough = {"specular_reflectance": tints["specular_reflectance"], **index}
    for variant, name in enumerate(DISTRIBUTIONS):
        for alpha_u, alpha_v in ((0.05, 0.3), (0.4, 0.1), (0.8, 0.02)):
            slots = [alpha_u, alpha_v] + eta + k + specular
            drawn("roughconductor", variant, slots,
                  mi.load_dict({"type": "roughconductor", "distribution": name, "alpha_u": alpha_u, "alpha_v": alpha_v,
                                **rough}))
            for ior in (1.5, 0.7):
                slots = [alpha_u, alpha_v, ior, 1] + specular + diffuse
                drawn("roughdielectric", variant, slots,
                      mi.load_dict({"type": "roughdielectric", "distribution": name, "alpha_u": alpha_u,
                                    "alpha_v": alpha_v, "int_ior": ior, "ext_ior": 1.0, **tints}), (0.97, -0.6, 0.25))
    principled()


if __name__ == "__main__":
    main()
