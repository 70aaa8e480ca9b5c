/* Why a number of a scene cannot be differentiated by, in words for people; for the host alone. */
#ifndef ITN_OBSTACLE_H
#define ITN_OBSTACLE_H
#ifndef __OPENCL_VERSION__

inline constexpr const char* differentiable = "";

/* Why such parameters cannot be rendered: "int_ior" "and ext_ior are both" 1.4; "need different ones". Without a
 * parameter: they can. */
struct Refusal {
  const char* parameter = "";
  const char* what = "";
  double value = 0;
  const char* need = "";
};
inline constexpr double least_alpha = 1e-4; /* smaller roughness is rendered as this one, as in Mitsuba */

/* The obstacle of numbers that are factors of a path's throughput: their score, 1 / value, is not defined where they
 * are 0. */
inline const char* unless_zero(double value) {
  if (value == 0) return "0: the paths that a change would bring have no probability; start from a small value";
  return value < 1e-30 ? "below 1e-30, where single precision loses its score; start from a larger value"
                       : differentiable;
}

#endif
#endif
