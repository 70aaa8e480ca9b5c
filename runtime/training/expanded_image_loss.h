// The image loss of an ITN to second order around the truth: what an error of the material is worth in the image, from
// derivative images that the data set has been rendered with. No rendering in the loop.
#pragma once
#include <memory>

#include "network/dataset_examples.h"
#include "network/loss.h"

namespace itn {

// Of an image whose material is predicted with an error of u = (log sigma_t, albedo, g): u^T C u over the object's mean
// square, C of image_curvature.h. For small errors it is the mean of what rendered_image_loss.h renders; for large ones
// it goes on growing where images have become all alike. Both have curvatures and shapes, and must outlive the loss.
std::unique_ptr<ImageLoss> make_expanded_image_loss(const DatasetImages& training, const DatasetImages& validation);

}  // namespace itn
