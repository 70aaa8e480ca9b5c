// What a network says about images, of what is known of them: a scene, a data set, or shape and light themselves.
#pragma once
#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "itn/distribution.h"
#include "itn/photo.h"
#include "itn/scene.h"
#include "network/training/judge.h"

namespace itn {

struct PredictionRequest {
  std::string run;  // trained_network.h
  // OpenEXR or photos; square, unless the network sees the object alone and `mask` tells where it is: then the square
  // around it is seen, in which it is as large as in the images that the network learnt from.
  std::vector<std::string> images;
  // For networks that know shape and light one of these; a scene also gives the unit of length.
  const Scene* scene = nullptr;
  int sensor = 0;
  std::string dataset = {};        // folder that the images belong to; of any network where they are its test images
  std::string shape_buffers = {};  // file of all images
  std::vector<double> light = {};  // and the direction to it
  // For networks that see a mask and the light of a flash: a file each for every image, or one mask for all. The
  // flash's shows the same as the image, by the same exposure, with the flash on.
  std::vector<std::string> mask = {}, flash = {};
  bool test_images = false;  // of `dataset`
  // Of the object: sigma_t is told for it, not for the size that shapes of the network's data sets have. Not with a
  // scene, whose unit of length it is in. 0: not known.
  double longest_side_mm = 0;
  PhotoOptions photo = {};
  // RUN of the judge (network/training/judge.h) that says whether images are like those that the network learnt from;
  // empty: the one that ships with `shipped-photos`, else none.
  std::string judge = {};
};

struct ImagePrediction {
  std::string file;
  // Where it, or its flash's, is saturated in more than a few pixels, and where the judge doubts.
  std::vector<std::string> warnings;
  std::vector<ParameterEstimate> parameters;  // one an output of the network
  std::optional<Verdict> verdict;             // of the judge
};

struct PredictedImages {
  NetworkDescription network;
  std::optional<double> doubt_limit;  // of the images' verdicts
  bool in_scene = false;              // sigma_t is in 1 / scene unit, else 1 / mm
  std::vector<ImagePrediction> images;
};

// each: is told of every image as soon as it is predicted; may be empty. Throws UsageError: what is known does not suit
// the network; InputError; Interrupted soon after cancel is set.
PredictedImages predict_images(const PredictionRequest& request, const std::atomic<bool>& cancel,
                               const std::function<void(const NetworkDescription&, const ImagePrediction&)>& each);

}  // namespace itn
