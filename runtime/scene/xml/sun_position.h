// Direction of the sun at a place and time.
#pragma once
#include "itn/scene.h"

namespace itn {

struct PlaceAndTime {
  double latitude = 35.6894, longitude = 139.6917;  // [degree], north and east positive
  double timezone = 9;                              // [hour] ahead of UTC
  int year = 2010, month = 7, day = 10;
  double hour = 15, minute = 0, second = 0;
};

// Unit vector towards the sun as Mitsuba's sunsky lays out its sky: x south, y west, z up. Good to about a minute of
// arc between 1999 and 2015 (Blanco-Muriel et al. 2001, Computing the solar vector, Solar Energy 70(5)).
Vec3 sun_direction(const PlaceAndTime& when);

}  // namespace itn
