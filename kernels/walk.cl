/* Scattering and nothing else: WIDTH paths a work-item fly and turn in an endless medium, in registers, with the random
 * numbers and the phase function of stage/medium.h. No surfaces, no stages, no stores: the limit of what a renderer of
 * homogeneous media can reach (`itn bench --stages`). */
#include "geometry/frame.h"
#include "path/random.h"
#include "model/medium/homogeneous.h"
#include "model/phase/henyey_greenstein.h"

/* out: x + y + z of where each path is after that many events. */
__kernel void walk(float sigma_t, float g, int events, uint seed, __global float* restrict out) {
  const INT path = LANE_INDEX + (int)get_global_id(0) * WIDTH;
  const REAL asymmetry = (REAL)(g);
  REAL3 position = make3((REAL)(0.0f), (REAL)(0.0f), (REAL)(0.0f)),
        direction = make3((REAL)(0.0f), (REAL)(0.0f), (REAL)(1.0f));
  for (int event = 0; event < events; ++event) {
    REAL u[4], cosine, sine, s, c;
    random4(AS_UINT(path), (UINT)(0u), (UINT)((uint)event), 0, seed, 0, u);
    position = add3(position, scale3(direction, medium_free_flight_sample((REAL)(sigma_t), u[0])));
    henyey_greenstein_sample(asymmetry, u[1], &cosine, &sine);
    sin_cos_2pi(u[2], &s, &c);
    const Frame frame = make_frame(direction);
    direction = frame_to_world(&frame, make3(sine * c, sine * s, cosine));
    direction = scale3(direction, 1.5f - 0.5f * dot3(direction, direction));
  }
  SCATTER(out, path, position.x + position.y + position.z);
}
