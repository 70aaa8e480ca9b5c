// From a sensor of a scene file to what the device reads.
#pragma once
#include "itn/scene.h"
#include "runtime/render/compile/launch_data.h"

namespace itn {

// shapes: the scene's. in_front: how far from surfaces rays begin [scene unit]. first_medium: of the scene in the
// launch. Appends to light_tables the surface on which the sensor lies.
CameraRecord camera_record(const Scene& scene, const Sensor& sensor, const GeometryRecord& shapes, double in_front,
                           int first_medium, LaunchData& data);

// A camera whose far plane lies behind the whole scene sees all of it.
void see_to_the_end(const GeometryRecord& geometry, CameraRecord& camera);

}  // namespace itn
