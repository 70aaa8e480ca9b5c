// The figures of "Inverse Transport Networks" (Che, Luan, Zhao, Bala, Gkioulekas 2018), tables 1 to 3.
#pragma once
#include <array>
#include <map>
#include <string>

namespace itn {

// Table 1: RMSE of sigma_t [1/mm], albedo, g.
inline const std::map<std::string, std::array<double, 3>> paper_training{
    {"rn", {24.43, 0.06, 0.13}}, {"itn", {41.80, 0.08, 0.25}}, {"ssn", {56.50, 0.17, 0.34}}};
inline const std::map<std::string, std::array<double, 3>> paper_testing{
    {"rn", {81.59, 0.15, 0.41}}, {"itn", {57.44, 0.10, 0.25}}, {"ssn", {65.06, 0.18, 0.35}}};

// Table 2: RMSE of the image, 1 - MS-SSIM.
inline const std::map<std::string, std::array<double, 2>> paper_training_images{
    {"rn", {0.3368, 0.0665}}, {"itn", {0.3299, 0.0609}}, {"ssn", {0.9444, 0.1673}}};
inline const std::map<std::string, std::array<double, 2>> paper_testing_images{
    {"rn", {0.3180, 0.1002}}, {"itn", {0.1631, 0.0426}}, {"ssn", {0.8735, 0.1585}}};

// Table 3: medians after 1, 50, 100, 150, 200 iterations; of squared errors of log sigma_t, albedo, g, and of the loss.
inline constexpr std::array<int, 5> paper_iterations{1, 50, 100, 150, 200};
inline const std::map<std::string, std::array<std::array<double, 5>, 4>> paper_synthesis{
    {"rn",
     {{{0.1506, 0.0488, 0.0346, 0.0265, 0.0224},
       {0.0092, 0.0009, 0.0006, 0.0006, 0.0005},
       {0.0812, 0.0404, 0.0205, 0.0121, 0.0069},
       {0.0670, 0.0041, 0.0023, 0.0018, 0.0015}}}},
    {"itn",
     {{{0.2084, 0.0805, 0.0191, 0.0090, 0.0047},
       {0.0039, 0.0010, 0.0008, 0.0003, 0.0002},
       {0.0354, 0.0276, 0.0143, 0.0065, 0.0031},
       {0.0189, 0.0024, 0.0019, 0.0015, 0.0013}}}}};

// ITN / RN of figures such as those above.
template <class Figures>
double paper_ratio(const Figures& figures, std::size_t what) {
  return figures.at("itn")[what] / figures.at("rn")[what];
}

}  // namespace itn
