// Mitsuba 3 in a process of its own, asked for one image at a time (mitsuba_peer.py).
#pragma once
#include <sys/types.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace itn {

struct PeerImage {
  double seconds = 0;
  std::vector<float> pixels;  // RGB
};

// Derivatives of the mean over pixels and channels by sigma_t, albedo (the sum over its components) and g of the
// scene's medium.
struct PeerGradient {
  double seconds = 0;
  double sigma_t = 0, albedo = 0, g = 0;
};

class MitsubaPeer {
 public:
  // python: the interpreter of a virtual environment with Mitsuba (tools/peers); folder: for the images that pass
  // through; variant: of Mitsuba, llvm_ad_rgb or cuda_ad_rgb. Throws UsageError when it does not start.
  MitsubaPeer(const std::string& python, std::string folder, const std::string& variant);
  ~MitsubaPeer();
  MitsubaPeer(const MitsubaPeer&) = delete;
  MitsubaPeer& operator=(const MitsubaPeer&) = delete;

  const std::string& version() const { return version_; }
  PeerImage render(const std::string& scene, int spp, std::uint64_t seed);
  // Value and gradient by prbvolpath.
  PeerGradient differentiate(const std::string& scene, int spp, std::uint64_t seed);
  // Value and gradient of the image's mean, by prb by the texels of a texture, by prbvolpath by the voxels of a
  // medium's sigma_t: `pixels` are theirs.
  PeerImage differentiate_by_texels(const std::string& scene, const std::string& texture, int spp, std::uint64_t seed);

 private:
  std::string image_file() const { return folder_ + "/peer.raw"; }
  PeerImage ask_for_image(const std::string& job, const std::string& scene);
  std::string read_line();
  std::string ask(const std::string& job, const std::string& scene);
  std::string folder_, version_;
  pid_t process_ = -1;
  std::FILE *to_ = nullptr, *from_ = nullptr;
};

}  // namespace itn
