// Renderings of a scene at known materials, each from two halves of its samples that know nothing of each other: what
// one half says where to look, the other says what is there. From the same samples both would share their noise, which
// in images of thousands of pixels is a greater sum than what an image tells of a material.
#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

namespace itn {

using ImageRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Rows: the image, then its derivatives by the natural coordinates; columns as TargetImage::value.
struct HalfImages {
  ImageRows value, error;  // standard errors
};

struct RenderedView {
  int spp = 0;  // of each half
  std::array<HalfImages, 2> half;
};

struct PosteriorRendering {
  Eigen::VectorXd at;               // natural coordinates (natural_range.h)
  std::vector<RenderedView> views;  // one a target
};

}  // namespace itn
