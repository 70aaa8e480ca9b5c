#include "path_bench.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <stdexcept>

#include "kernels/model/models.h"
#include "runtime/render/compile/surfaces.h"
#include "runtime/render/derivative/score_functions.h"

namespace itn::test {
namespace {

// Philox4x32-10 once more, in plain integers.
std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> x, std::uint32_t key0, std::uint32_t key1) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = std::uint64_t{0xD2511F53} * x[0], b = std::uint64_t{0xCD9E8D57} * x[2];
    x = {static_cast<std::uint32_t>(b >> 32) ^ x[1] ^ key0, static_cast<std::uint32_t>(b),
         static_cast<std::uint32_t>(a >> 32) ^ x[3] ^ key1, static_cast<std::uint32_t>(a)};
    key0 += 0x9E3779B9u;
    key1 += 0xBB67AE85u;
  }
  return x;
}

// Calls visit(field number, member) for every member of a path that the program has.
template <class SomePath, class Has, class Visit>
void each_field(const PathFields& fields, SomePath& p, std::size_t throughput, std::size_t radiance, const Has& has,
                const Visit& visit) {
  const auto several = [&](const char* field, auto& members, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) visit(fields.first.at(field) + k, members[k]);
  };
  const auto one = [&](const char* field, auto& member) { visit(fields.first.at(field), member); };
  several("POSITION", p.position, 3);
  several("DIRECTION", p.direction, 3);
  several("THROUGHPUT", p.throughput, throughput);
  several("RADIANCE", p.radiance, radiance);
  one("REFRACTION_SCALE", p.refraction_scale);
  one("PIXEL", p.pixel);
  one("SAMPLE", p.sample);
  one("EVENT", p.event);
  one("DEPTH", p.depth);
  one("MEDIUM", p.medium);
  one("SKIP", p.skip);
  one("PASSED", p.passed);
  one("HIT", p.hit);
  visit(fields.first.at("HIT_PLACE"), p.hit_u);
  visit(fields.first.at("HIT_PLACE") + 1, p.hit_v);
  one("LAST_PDF", p.last_pdf);
  one("JOB", p.job);
  if (has("SPECTRAL")) {
    several("SPECTRAL_WEIGHT", p.spectral_weight, 3);
    one("HERO", p.hero);
  }
  if (has("MEDIUM_LIGHT_SAMPLING")) {
    several("ARRIVAL", p.arrival, 3);
    one("CHANCE", p.chance);
  }
  if (has("HAS_AREA_LIGHTS") && has("LIGHT_SAMPLING")) several("ORIGIN", p.origin, 3);
  if (has("HAS_AREA_LIGHTS") && has("ROUGH_LIGHT_SAMPLING")) one("LAST_PDF_DIVISOR", p.last_pdf_divisor);
}

// By the names of kernels.
const std::map<std::string, Queue> queue_of_stage{{"generate", Queue::free},
                                                  {"ray", Queue::ray},
                                                  {"medium", Queue::medium},
                                                  {"connect", Queue::connect},
                                                  {"escape", Queue::escape},
                                                  {"null", Queue::null},
                                                  {"diffuse_0", Queue::diffuse},
                                                  {"dielectric_0", Queue::dielectric},
                                                  {"rough_dielectric_0", Queue::rough_beckmann},
                                                  {"rough_dielectric_1", Queue::rough_ggx}};

}  // namespace

PathBench::PathBench(const Device& device, const Scene& scene, const Options& options)
    : device_(device), width_(options.width) {
  if (const char* width = std::getenv("ITN_TEST_WIDTH")) width_ = std::atoi(width);
  data_.geometry.box_width = 4;
  job_ = append_scene(scene, 0, data_);
  job_.seed_low = static_cast<unsigned>(options.seed);
  job_.seed_high = static_cast<unsigned>(options.seed >> 32);
  definitions_ = feature_definitions(data_);
  if (!options.light_sampling)
    for (const char* name : {"LIGHT_SAMPLING", "MEDIUM_LIGHT_SAMPLING", "ROUGH_LIGHT_SAMPLING"})
      definitions_[name] = std::to_string(0);
  definitions_["WIDTH"] = std::to_string(width_);
  definitions_["BOX_WIDTH"] = std::to_string(data_.geometry.box_width);
  definitions_["FUSED"] = std::to_string(0);
  definitions_["MEDIUM_EVENTS"] = std::to_string(options.medium_events);
  definitions_["OPERATOR_SINGLE"] = std::to_string(options.op == Operator::single);
  throughput_channels_ = static_cast<std::size_t>(std::stoi(definitions_["THROUGHPUT_CHANNELS"]));
  radiance_channels_ = static_cast<std::size_t>(std::stoi(definitions_["RADIANCE_CHANNELS"]));
  for (const char* none : {"SCORES", "DERIVATIVES", "ALBEDOS", "BASELINES", "ADJOINT", "PARTS", "LIGHT_NUMBERS"})
    definitions_[none] = std::to_string(0);
  definitions_["SCORE_RECORDS"] = "{0,0,0,0}";
  definitions_["PART_RECORDS"] = "{0,{0,0,0}}";
  program_ = device.build("wavefront.cl", definitions_,
                          {{"program/scores.h", print_scores({}, static_cast<int>(throughput_channels_))},
                           {"program/surfaces.h", surfaces_text(data_)}});
  fields_ = path_fields(definitions_);
  stages_ = stages_of(data_);
  for (const std::string& stage : stages_) queues_.push_back(queue_of_stage.at(stage));
  buffers_.upload_geometry(device, data_.geometry);
  buffers_.upload_scenes(device, data_);
  for (cl::Buffer* unused :
       {&buffers_.derivatives, &buffers_.futures, &buffers_.visits, &buffers_.pixel_adjoints, &buffers_.gradient})
    *unused = device.upload(std::vector<float>{}, "unused");
  buffers_.misplaced = device.upload(std::vector<cl_uint>{0}, "misplaced");
  buffers_.endless = device.upload(std::vector<cl_uint>{0}, "endless");
}

Queue PathBench::queue_of(const Bsdf& bsdf) const {
  if (!bsdf.model) return Queue::null;
  return queue_of_stage.at(bsdf.model->name + "_" + std::to_string(bsdf.variant));
}

std::size_t PathBench::number_of(Queue queue) const {
  const auto found = std::find(queues_.begin(), queues_.end(), queue);
  if (found == queues_.end()) throw std::logic_error("the scene has no such surface");
  return static_cast<std::size_t>(found - queues_.begin());
}

std::uint64_t PathBench::misplaced() const {
  std::vector<cl_uint> count(1);
  device_.download(buffers_.misplaced, count);
  return count[0];
}

cl_uint PathBench::set_scene(cl::Kernel& kernel, const cl::Buffer& jobs, const cl::Buffer& samples) const {
  LaunchBuffers buffers = buffers_;
  buffers.jobs = jobs;
  buffers.samples = samples;
  return buffers.set_arguments(kernel);
}

std::vector<float> PathBench::pack(const std::vector<Path>& paths) const {
  const std::size_t s = stride(paths.size());
  // what idle lanes find in the dump must not matter: huge as float and as int
  std::vector<float> storage((fields_.size + 2 * stages_.size()) * s, std::bit_cast<float>(0x7f123456));
  for (std::size_t i = 0; i < paths.size(); ++i)
    each_field(
        fields_, paths[i], throughput_channels_, radiance_channels_,
        [this](const char* feature) { return has(feature); },
        [&](std::size_t field, const auto& member) {
          if constexpr (std::is_same_v<std::decay_t<decltype(member)>, int>)
            storage[field * s + i] = std::bit_cast<float>(member);
          else
            storage[field * s + i] = static_cast<float>(member);
        });
  return storage;
}

void PathBench::unpack(const std::vector<float>& storage, std::vector<Path>& paths) const {
  const std::size_t s = stride(paths.size());
  for (std::size_t i = 0; i < paths.size(); ++i) {
    Path& p = paths[i];
    each_field(
        fields_, p, throughput_channels_, radiance_channels_, [this](const char* feature) { return has(feature); },
        [&](std::size_t field, auto& member) {
          if constexpr (std::is_same_v<std::decay_t<decltype(member)>, int>)
            member = std::bit_cast<int>(storage[field * s + i]);
          else
            member = static_cast<double>(storage[field * s + i]);
        });
    for (std::size_t c = throughput_channels_; c < 3; ++c) p.throughput[c] = p.throughput[0];
    for (std::size_t c = radiance_channels_; c < 3; ++c) p.radiance[c] = p.radiance[0];
  }
}

// Reads which queue each slot waits in. Throws if a slot is in no queue or in two.
void PathBench::read_queues(const std::vector<float>& storage, const std::vector<int>& lengths, std::size_t stride,
                            std::vector<Path>& paths) const {
  const std::size_t queue_count = stages_.size();
  std::vector<int> seen(paths.size(), 0);
  for (std::size_t q = 0; q < queue_count; ++q)
    for (std::size_t k = 0; k < static_cast<std::size_t>(lengths[queue_count + q]); ++k) {
      const int slot = std::bit_cast<int>(storage[(fields_.size + queue_count + q) * stride + k]);
      if (slot < 0 || static_cast<std::size_t>(slot) >= paths.size())
        throw std::logic_error("a queue holds a slot that does not exist");
      paths[static_cast<std::size_t>(slot)].queue = queues_[q];
      ++seen[static_cast<std::size_t>(slot)];
    }
  if (std::any_of(seen.begin(), seen.end(), [](int times) { return times != 1; }))
    throw std::logic_error("a path waits in no queue or in two");
}

std::vector<Path> PathBench::generate(int pixels, int samples) {
  const std::size_t n = static_cast<std::size_t>(pixels) * static_cast<std::size_t>(samples);
  std::vector<Path> paths(n);
  job_.samples = samples;
  const cl::Buffer jobs = device_.upload(std::vector<JobRecord>{job_}, "jobs");
  const cl::Buffer gathered = device_.allocate(n * radiance_channels_ * sizeof(float), "samples");
  std::vector<float> storage = pack(paths);
  const cl::Buffer pool = device_.upload(storage, "pool");
  const int count = static_cast<int>(n);
  // two chunks, so that their table is used
  const std::vector<ChunkRecord> chunks{{0, 0, count / 3, 0}, {0, count / 3, count - count / 3, count / 3}};
  const cl::Buffer chunk_buffer = device_.upload(chunks, "chunks");
  std::vector<int> lengths(2 * stages_.size());
  const cl::Buffer lengths_buffer = device_.upload(lengths, "lengths");
  cl::Kernel fill(program_, "fill_free_queue"), kernel(program_, "generate");
  fill.setArg(0, pool);
  fill.setArg(1, count);
  fill.setArg(2, lengths_buffer);
  device_.launch(fill, n, 1);
  cl_uint at = set_scene(kernel, jobs, gathered);
  kernel.setArg(at++, chunk_buffer);
  kernel.setArg(at++, 2);
  kernel.setArg(at++, 0);
  kernel.setArg(at++, count);
  kernel.setArg(at++, pool);
  kernel.setArg(at++, count);
  kernel.setArg(at++, lengths_buffer);
  kernel.setArg(at++, 0);
  const std::size_t groups = (n + static_cast<std::size_t>(width_) - 1) / static_cast<std::size_t>(width_);
  device_.launch(kernel, groups, 1);
  device_.finish();
  device_.download(pool, storage);
  device_.download(lengths_buffer, lengths);
  unpack(storage, paths);
  read_queues(storage, lengths, stride(n), paths);
  return paths;
}

void PathBench::run(Queue stage, std::vector<Path>& all) {
  std::vector<Path> paths;  // path i in slot i
  for (const Path& p : all)
    if (p.queue == stage) paths.push_back(p);
  if (paths.empty()) return;
  JobRecord job = job_;
  int highest = 0, most = 0;
  for (const Path& p : paths) {
    highest = std::max(highest, p.pixel);
    most = std::max(most, p.sample);
  }
  job.samples = most + 1;
  const std::size_t outputs = static_cast<std::size_t>(highest + 1) * static_cast<std::size_t>(job.samples);
  constexpr float unwritten = -1e30f;
  const cl::Buffer jobs = device_.upload(std::vector<JobRecord>{job}, "jobs");
  std::vector<float> samples(outputs * radiance_channels_, unwritten);
  const cl::Buffer gathered = device_.upload(samples, "samples");
  std::vector<float> storage = pack(paths);
  const std::size_t n = paths.size(), s = stride(n), q = number_of(stage);
  for (std::size_t k = 0; k < n; ++k) storage[(fields_.size + q) * s + k] = std::bit_cast<float>(static_cast<int>(k));
  std::vector<int> lengths(2 * stages_.size());
  lengths[q] = static_cast<int>(n);
  const cl::Buffer pool = device_.upload(storage, "pool"), lengths_buffer = device_.upload(lengths, "lengths");
  cl::Kernel kernel(program_, stages_[q].c_str());
  cl_uint at = set_scene(kernel, jobs, gathered);
  kernel.setArg(at++, pool);
  kernel.setArg(at++, static_cast<int>(n));
  kernel.setArg(at++, lengths_buffer);
  kernel.setArg(at++, 0);
  device_.launch(kernel, (n + static_cast<std::size_t>(width_) - 1) / static_cast<std::size_t>(width_), 1);
  device_.finish();
  device_.download(pool, storage);
  device_.download(lengths_buffer, lengths);
  device_.download(gathered, samples);
  unpack(storage, paths);
  read_queues(storage, lengths, s, paths);
  std::size_t next = 0;
  for (Path& path : all) {
    if (path.queue != stage) continue;
    Path& p = paths[next++];
    const std::size_t output = static_cast<std::size_t>(p.pixel * job.samples + p.sample);
    if ((p.queue == Queue::free) != (samples[output * radiance_channels_] != unwritten))
      throw std::logic_error("a path ends if and only if its sample is written");
    if (p.queue == Queue::free)
      for (std::size_t c = 0; c < 3; ++c)
        p.sample_radiance[c] =
            static_cast<double>(samples[output * radiance_channels_ + std::min(c, radiance_channels_ - 1)]);
    path = p;
  }
}

void PathBench::run_all(std::vector<Path>& paths) {
  for (bool going = true; going;) {
    going = false;
    for (std::size_t q = 1; q < queues_.size(); ++q) {
      const Queue queue = queues_[q];
      if (std::none_of(paths.begin(), paths.end(), [&](const Path& p) { return p.queue == queue; })) continue;
      run(queue, paths);
      going = true;
    }
  }
}

std::array<double, 4> PathBench::random(const Path& path, unsigned stream, int event_offset) const {
  const auto bits = philox({static_cast<std::uint32_t>(path.pixel), static_cast<std::uint32_t>(path.sample),
                            static_cast<std::uint32_t>(path.event + event_offset), stream},
                           job_.seed_low, job_.seed_high);
  std::array<double, 4> u;
  for (std::size_t k = 0; k < 4; ++k) u[k] = (static_cast<double>(bits[k] >> 9) + 0.5) * 0x1p-23;
  return u;
}

}  // namespace itn::test
