/* Share of the light that a rough dielectric interface lets pass, by the cosine mu of the angle outside:
 *
 *   T(mu) = mean over the visible normals m of (1 - F(wi.m)) G1(wt),  wt: wi refracted at m
 *
 * and the share R of diffuse light from inside that it reflects. There is no closed form: the host integrates T in
 * ROUGH_TRANSMITTANCE_KNOTS angles, and the device has the polynomial through them, as Chebyshev coefficients over
 *
 *   x = (1 + a) mu / (mu + a) in [0, 1],  a = 0.1 + 2 alpha,
 *
 * which spreads the angles near grazing ones, where T changes most. Within 1e-3 of T beyond mu = 1/64 (2e-3 for GGX
 * with alpha 1), mostly 3e-4, for alpha from 0.01 and indices 1.1 to 2.2. Mitsuba 3's "roughplastic" interpolates
 * between 64 angles. Both integrals are smooth in alpha and index, so that the chain rule can be run through them.
 *   Walter, Marschner, Li, Torrance 2007, "Microfacet models for refraction through rough surfaces"
 * Tests: tests/model/plastics_test.cpp */
#ifndef ITN_ROUGH_TRANSMITTANCE_H
#define ITN_ROUGH_TRANSMITTANCE_H
#include "model/fresnel_dielectric.h"
#include "model/microfacet.h"

#define ROUGH_TRANSMITTANCE_KNOTS 8

MODEL rough_transmittance_spread(REAL alpha) { return NUMBER(0.1) + NUMBER(2) * alpha; }

/* T(mu), mu >= 0; c: the coefficients. Not 0, whose logarithm has no derivative. */
MODEL rough_transmittance(REAL alpha, const REAL* c, REAL mu) {
  REAL a = rough_transmittance_spread(alpha);
  REAL y = NUMBER(2) * mu * (NUMBER(1) + a) / (mu + a) - NUMBER(1);
  REAL b1 = NUMBER(0), b2 = NUMBER(0);
  UNROLL_FOR(int k = ROUGH_TRANSMITTANCE_KNOTS - 1; k > 0; --k) { /* Clenshaw */
    REAL b = NUMBER(2) * y * b1 - b2 + c[k];
    b2 = b1;
    b1 = b;
  }
  return MAX(y * b1 - b2 + c[0], NUMBER(1e-4));
}

#ifndef __OPENCL_VERSION__
#include <array>
#include <cmath>

/* Nodes in (0, 1) and weights of Gauss and Legendre. */
template <int count>
struct GaussLegendre {
  std::array<double, count> node, weight;
  GaussLegendre() {
    for (int i = 0; i < count; ++i) {
      double x = std::cos(PI_ * (i + 0.75) / (count + 0.5)), slope = 1;
      for (int step = 0; step < 10; ++step) {
        double before = 1, p = x;
        for (int k = 2; k <= count; ++k) {
          const double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
          before = p;
          p = next;
        }
        slope = count * (x * p - before) / (x * x - 1);
        x -= p / slope;
      }
      node[static_cast<std::size_t>(i)] = (1 - x) / 2;
      weight[static_cast<std::size_t>(i)] = 1 / ((1 - x * x) * slope * slope);
    }
  }
};

/* The mean of what(wi, m) over the visible normals m of wi = (sine, 0, mu), whatever the sign of m.y: along one
 * random number of the sampler by Gauss, along the other by half a period: GGX turns evenly, Beckmann's slopes
 * across are symmetric. */
template <int along, int across, class REAL, class What>
inline REAL mean_over_visible_normals(int distribution, REAL alpha, REAL mu, const What& what) {
  static const GaussLegendre<along> first;
  static const GaussLegendre<across> second;
  const REAL3 wi = make3(SQRT(NUMBER(1) - mu * mu), NUMBER(0), mu);
  REAL sum = NUMBER(0);
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < across; ++j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      const bool ggx = distribution == MICROFACET_GGX;
      const REAL u = NUMBER(first.node[a]);
      const REAL half = NUMBER(ggx ? (j + 0.5) / (2 * across) : second.node[b] / 2);
      const REAL3 m = ggx ? microfacet_visible_sample(distribution, wi, alpha, half, u)
                          : microfacet_visible_sample(distribution, wi, alpha, u, half);
      sum += NUMBER(first.weight[a] * (ggx ? 1.0 / across : second.weight[b])) * what(wi, m);
    }
  return sum;
}

/* T(mu), integrated. eta: far over near index. */
MODEL rough_transmittance_integral(int distribution, REAL alpha, REAL eta, REAL mu) {
  return mean_over_visible_normals<24, 12>(distribution, alpha, mu, [&](const REAL3& wi, const REAL3& m) {
    REAL f, ct;
    const REAL ci = dot3(wi, m);
    fresnel_dielectric_refract(MIN(ci, NUMBER(1)), eta, &f, &ct);
    const REAL3 wt = sub3(scale3(m, ci / eta - ct), scale3(wi, NUMBER(1) / eta));
    const bool passes = wt.z < NUMBER(0) && ct > NUMBER(0);
    return passes ? (NUMBER(1) - f) * microfacet_shadowing(distribution, wt, alpha) : NUMBER(0);
  });
}

/* The share of diffuse light that is mirrored: 1 / pi times the integral over facets m and azimuths about m of D(m)
 * G1(wi) G1(wo), wi: with the cosine ci at the facet, wo: its mirror image. Times ci and reflectance of the facet,
 * integrated over ci, it is the light that is mirrored. So the edge of total reflection lies at the end of an integral
 * over ci: a kink inside would spoil its derivatives. */
template <class REAL>
inline REAL mirrored_back(int distribution, REAL alpha, REAL ci) {
  constexpr int facets = 24, azimuths = 12;
  static const GaussLegendre<facets> of_facets;
  static const GaussLegendre<azimuths> of_azimuths;
  const REAL si = SQRT(MAX(NUMBER(1) - ci * ci, NUMBER(1e-12)));
  REAL sum = NUMBER(0);
  for (int i = 0; i < facets; ++i) {
    const double u = of_facets.node[static_cast<std::size_t>(i)];
    const double slope2 = distribution == MICROFACET_GGX ? u / (1 - u) : -std::log(1 - u);
    const REAL tangent2 = alpha * alpha * NUMBER(slope2);
    const REAL cosine = NUMBER(1) / SQRT(NUMBER(1) + tangent2), sine = SQRT(tangent2) * cosine;
    /* both directions are above the surface where |cos azimuth| < bound */
    const REAL bound = MIN(ci * cosine / (si * sine), NUMBER(1));
    for (int j = 0; j < azimuths; ++j) {
      const double angle = PI_ * (of_azimuths.node[static_cast<std::size_t>(j)] - 0.5);
      const REAL x = bound * NUMBER(std::sin(angle));
      const REAL arc = bound * NUMBER(std::cos(angle) * PI_ * of_azimuths.weight[static_cast<std::size_t>(j)]) /
                       SQRT(NUMBER(1) - x * x);
      const REAL in_plane = ci * cosine + si * sine * x, out_plane = ci * cosine - si * sine * x;
      const REAL3 wi = make3(SQRT(MAX(NUMBER(1) - in_plane * in_plane, NUMBER(0))), NUMBER(0), in_plane);
      const REAL3 wo = make3(SQRT(MAX(NUMBER(1) - out_plane * out_plane, NUMBER(0))), NUMBER(0), out_plane);
      const REAL seen = distribution == MICROFACET_GGX ? ggx_shadowing(wi, alpha) : beckmann_shadowing_exact(wi, alpha);
      sum += NUMBER(of_facets.weight[static_cast<std::size_t>(i)] * 2 / PI_) * arc / cosine * seen *
             microfacet_shadowing(distribution, wo, alpha);
    }
  }
  return sum;
}

/* The coefficients c of T. eta > 1: inside over outside */
MODEL_VOID rough_transmittance_coefficients(int distribution, REAL alpha, REAL eta, REAL* c) {
  constexpr int knots = ROUGH_TRANSMITTANCE_KNOTS;
  const REAL a = rough_transmittance_spread(alpha);
  for (int k = 0; k < knots; ++k) c[k] = NUMBER(0);
  for (int j = 0; j < knots; ++j) {
    const double angle = PI_ * (j + 0.5) / knots;
    const REAL x = NUMBER((1 + std::cos(angle)) / 2);
    const REAL t = rough_transmittance_integral(distribution, alpha, eta, x * a / (NUMBER(1) + a - x));
    for (int k = 0; k < knots; ++k) c[k] += t * NUMBER((k == 0 ? 1.0 : 2.0) / knots * std::cos(k * angle));
  }
}

/* R: what is mirrored back, less what is let out, which is that times 1 - F, over the cosine outside; eta > 1:
 * inside over outside. Mitsuba 3 takes the mean over 64 cosines from 0 to 1, both ends included, for the integral: 1
 * to 2 % less. So does this, that the base be as bright as there. */
MODEL rough_trapped(int distribution, REAL alpha, REAL eta) {
  constexpr int angles = 16;
  static const GaussLegendre<angles> rule;
  REAL mirrored = NUMBER(0), let_out = NUMBER(0);
  for (int i = 0; i < angles; ++i) {
    const REAL c = NUMBER(rule.node[static_cast<std::size_t>(i)]);
    const REAL weight = NUMBER(rule.weight[static_cast<std::size_t>(i)]) * c;
    mirrored += weight * mirrored_back(distribution, alpha, c);
    const REAL ci = SQRT(NUMBER(1) - (NUMBER(1) - c * c) / (eta * eta));
    let_out += weight / (eta * eta) * (NUMBER(1) - fresnel_dielectric(c, eta)) * mirrored_back(distribution, alpha, ci);
  }
  const auto reflected = [&](const REAL3& wi, const REAL3& m) {
    const REAL ci = dot3(wi, m), f = fresnel_dielectric(MIN(ci, NUMBER(1)), NUMBER(1) / eta);
    const REAL3 wo = sub3(scale3(m, NUMBER(2) * ci), wi);
    return wo.z > NUMBER(0) ? f * microfacet_shadowing(distribution, wo, alpha) : NUMBER(0);
  };
  const REAL upright = mean_over_visible_normals<24, 12>(distribution, alpha, NUMBER(1), reflected);
  return (NUMBER(63) * (mirrored - let_out) + upright) / NUMBER(64);
}
#endif

#endif
