#include "runtime/scene/xml/sun_position.h"

#include <chrono>
#include <cmath>

namespace itn {

Vec3 sun_direction(const PlaceAndTime& when) {
  constexpr double degree = M_PI / 180;
  const double universal_hour = when.hour - when.timezone + (when.minute + when.second / 60) / 60;
  const auto date = std::chrono::sys_days{std::chrono::year{when.year} / when.month / when.day};
  const auto epoch = std::chrono::sys_days{std::chrono::year{2000} / 1 / 1};
  const double days =
      static_cast<double>((date - epoch).count()) - 0.5 + universal_hour / 24;  // since noon of the epoch

  // Ecliptic coordinates [rad].
  const double lunar_node = 2.1429 - 0.0010394594 * days;
  const double mean_longitude = 4.8950630 + 0.017202791698 * days, mean_anomaly = 6.2400600 + 0.0172019699 * days;
  const double longitude = mean_longitude + 0.03341607 * std::sin(mean_anomaly) +
                           0.00034894 * std::sin(2 * mean_anomaly) - 0.0001134 - 0.0000203 * std::sin(lunar_node);
  const double obliquity = 0.4090928 - 6.2140e-9 * days + 0.0000396 * std::cos(lunar_node);

  // Celestial, then local coordinates.
  const double right_ascension = std::atan2(std::cos(obliquity) * std::sin(longitude), std::cos(longitude));
  const double declination = std::asin(std::sin(obliquity) * std::sin(longitude));
  const double sidereal_hour = 6.6974243242 + 0.0657098283 * days + universal_hour;
  const double hour_angle = (sidereal_hour * 15 + when.longitude) * degree - right_ascension;
  const double sin_latitude = std::sin(when.latitude * degree), cos_latitude = std::cos(when.latitude * degree);
  double zenith =
      std::acos(cos_latitude * std::cos(hour_angle) * std::cos(declination) + std::sin(declination) * sin_latitude);
  const double azimuth =
      std::atan2(-std::sin(hour_angle),
                 std::tan(declination) * cos_latitude - sin_latitude * std::cos(hour_angle));  // from north over east
  zenith += 6371.01 / 149597890.0 * std::sin(zenith);  // parallax: radius of the earth over distance of the sun
  return {-std::sin(zenith) * std::cos(azimuth), -std::sin(zenith) * std::sin(azimuth), std::cos(zenith)};
}

}  // namespace itn
