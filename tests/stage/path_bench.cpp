#include "path_bench.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <stdexcept>

#include "runtime/derivative/score_functions.h"

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

// Calls visit(field number, member) for every member of a path in the order of path_state.h.
template <class SomePath, class Visit>
std::size_t each_field(SomePath& p, std::size_t throughput, std::size_t radiance, bool spectral, bool connects,
                       const Visit& visit) {
  std::size_t field = 0;
  for (std::size_t k = 0; k < 3; ++k) visit(field++, p.position[k]);
  for (std::size_t k = 0; k < 3; ++k) visit(field++, p.direction[k]);
  for (std::size_t c = 0; c < throughput; ++c) visit(field++, p.throughput[c]);
  for (std::size_t c = 0; c < radiance; ++c) visit(field++, p.radiance[c]);
  visit(field++, p.refraction_scale);
  visit(field++, p.pixel);
  visit(field++, p.sample);
  visit(field++, p.event);
  visit(field++, p.depth);
  visit(field++, p.medium);
  visit(field++, p.skip);
  visit(field++, p.passed);
  visit(field++, p.hit);
  visit(field++, p.hit_u);
  visit(field++, p.hit_v);
  visit(field++, p.last_pdf);
  visit(field++, p.job);
  if (spectral) {
    for (std::size_t c = 0; c < 3; ++c) visit(field++, p.spectral_weight[c]);
    visit(field++, p.hero);
  }
  if (connects) {
    for (std::size_t k = 0; k < 3; ++k) visit(field++, p.arrival[k]);
    visit(field++, p.chance);
  }
  return field;
}

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
  definitions_["SCORES"] = definitions_["DERIVATIVES"] = definitions_["BASELINES"] = definitions_["ADJOINT"] =
      definitions_["PARTS"] = definitions_["LIGHT_NUMBERS"] = "0";
  definitions_["SCORE_RECORDS"] = "{0,0,0}";
  definitions_["PART_RECORDS"] = "{0,{0,0,0}}";
  program_ = device.build("wavefront.cl", definitions_, {{"derivative/score.h", print_scores({})}});
  misplaced_ = device.upload(std::vector<cl_uint>{0}, "misplaced");
  const Path none;
  fields_ = each_field(none, throughput_channels_, radiance_channels_, has("SPECTRAL"), has("MEDIUM_LIGHT_SAMPLING"),
                       [](std::size_t, const auto&) {});
  if (fields_ != PATH_FIELDS(throughput_channels_, radiance_channels_, std::size_t{has("SPECTRAL")},
                             std::size_t{has("MEDIUM_LIGHT_SAMPLING")}, 0, 0, 0, 0))
    throw std::logic_error("the members of a path are not those of path_state.h");
  const Geometry& g = data_.geometry;
  scene_ = {device.upload(g.nodes, "nodes"),
            device.upload(g.leaves, "leaves"),
            device.upload(g.primitives, "primitives"),
            device.upload(g.grid, "grid"),
            device.upload(g.records, "geometries"),
            {},  // jobs
            device.upload(data_.cameras, "cameras"),
            device.upload(data_.shapes, "shapes"),
            device.upload(data_.bsdfs, "bsdfs"),
            device.upload(data_.media, "media"),
            device.upload(data_.emitters, "emitters"),
            device.upload(data_.emitter_tables, "tables"),
            device.upload(data_.textures, "textures"),
            device.upload(data_.texels, "texels"),
            device.upload(std::vector<int>{}, "derivatives"),
            device.upload(std::vector<float>{}, "expected futures"),
            device.upload(std::vector<float>{}, "visits"),
            device.upload(std::vector<float>{}, "pulls"),
            device.upload(std::vector<int>{}, "gradient")};
}

std::uint64_t PathBench::misplaced() const {
  std::vector<cl_uint> count(1);
  device_.download(misplaced_, count);
  return count[0];
}

void PathBench::set_scene(cl::Kernel& kernel, const cl::Buffer& jobs, const cl::Buffer& samples) const {
  for (cl_uint k = 0; k < scene_.size(); ++k) kernel.setArg(k, k == 5 ? jobs : scene_[k]);
  kernel.setArg(static_cast<cl_uint>(scene_.size()), samples);
  kernel.setArg(static_cast<cl_uint>(scene_.size()) + 1, misplaced_);
}

std::vector<float> PathBench::pack(const std::vector<Path>& paths) const {
  const std::size_t s = stride(paths.size());
  // what idle lanes find in the dump must not matter: huge as float and as int
  std::vector<float> storage((fields_ + 2 * queue_count) * s, std::bit_cast<float>(0x7f123456));
  for (std::size_t i = 0; i < paths.size(); ++i)
    each_field(paths[i], throughput_channels_, radiance_channels_, has("SPECTRAL"), has("MEDIUM_LIGHT_SAMPLING"),
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
    each_field(p, throughput_channels_, radiance_channels_, has("SPECTRAL"), has("MEDIUM_LIGHT_SAMPLING"),
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

namespace {

// Which queue each slot waits in. Throws where a slot is in no queue or in two.
void read_queues(const std::vector<float>& storage, const std::vector<int>& lengths, std::size_t fields,
                 std::size_t stride, std::vector<Path>& paths) {
  std::vector<int> seen(paths.size(), 0);
  for (std::size_t q = 0; q < queue_count; ++q)
    for (std::size_t k = 0; k < static_cast<std::size_t>(lengths[queue_count + q]); ++k) {
      const int slot = std::bit_cast<int>(storage[(fields + queue_count + q) * stride + k]);
      if (slot < 0 || static_cast<std::size_t>(slot) >= paths.size())
        throw std::logic_error("a queue holds a slot that does not exist");
      paths[static_cast<std::size_t>(slot)].queue = static_cast<Queue>(q);
      ++seen[static_cast<std::size_t>(slot)];
    }
  if (std::any_of(seen.begin(), seen.end(), [](int times) { return times != 1; }))
    throw std::logic_error("a path waits in no queue or in two");
}

}  // namespace

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
  std::vector<int> lengths(2 * queue_count);
  const cl::Buffer lengths_buffer = device_.upload(lengths, "lengths");
  cl::Kernel fill(program_, "fill_free_queue"), kernel(program_, "generate");
  fill.setArg(0, pool);
  fill.setArg(1, count);
  fill.setArg(2, lengths_buffer);
  device_.launch(fill, n, 1);
  set_scene(kernel, jobs, gathered);
  cl_uint at = static_cast<cl_uint>(scene_.size()) + 2;
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
  read_queues(storage, lengths, fields_, stride(n), paths);
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
  const std::size_t n = paths.size(), s = stride(n), q = static_cast<std::size_t>(stage);
  for (std::size_t k = 0; k < n; ++k) storage[(fields_ + q) * s + k] = std::bit_cast<float>(static_cast<int>(k));
  std::vector<int> lengths(2 * queue_count);
  lengths[q] = static_cast<int>(n);
  const cl::Buffer pool = device_.upload(storage, "pool"), lengths_buffer = device_.upload(lengths, "lengths");
  cl::Kernel kernel(program_, "stage");
  set_scene(kernel, jobs, gathered);
  cl_uint at = static_cast<cl_uint>(scene_.size()) + 2;
  kernel.setArg(at++, static_cast<int>(stage));
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
  read_queues(storage, lengths, fields_, s, paths);
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
    for (int q = 1; q < queue_count; ++q) {
      const auto queue = static_cast<Queue>(q);
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
