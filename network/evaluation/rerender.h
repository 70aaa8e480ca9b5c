// Many of a data set's images rendered again, a few million paths at a time.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "network/dataset/rendered_loss.h"

namespace itn {

// Purposes of random numbers: images of different streams are independent, and those of one stream have the same random
// numbers for every network that is compared, so that differences between networks are not noise.
enum class EvaluationStream : std::uint64_t { rerendering, information, iterations, recorded_loss };

std::uint64_t image_seed(std::uint64_t seed, EvaluationStream stream, std::uint64_t index);

// Number of images of spp samples a pixel that make a batch of some four million paths; at least one.
std::size_t images_per_batch(int size, int spp);

// call(first, end) for one batch of 0 ... count - 1 after the other.
void in_batches(std::size_t count, std::size_t at_once, const std::function<void(std::size_t, std::size_t)>& call);

// As RenderedLoss::render(), in batches. after: called after each with how many images are done; may be empty.
std::vector<Rendering> rerender(RenderedLoss& renderer, const std::vector<RerenderedImage>& images, int size, int spp,
                                const std::function<void(std::size_t)>& after);

}  // namespace itn
