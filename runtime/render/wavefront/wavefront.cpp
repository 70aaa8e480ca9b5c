#include "runtime/render/wavefront/wavefront.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <limits>
#include <utility>

#include "itn/error.h"
#include "kernels/model/models.h"
#include "kernels/shared/path_state.h"
#include "runtime/base/seconds_since.h"
#include "runtime/render/compile/surfaces.h"
#include "runtime/render/wavefront/baseline.h"
#include "runtime/render/wavefront/path_fields.h"

namespace itn {
namespace {

constexpr int fused_slots = 512;       // paths a pool: 256 to 1024 are equally fast, more leave idle tails
constexpr int staged_slots = 1 << 22;  // paths in flight on a GPU
constexpr std::size_t least_slots = 1 << 10, least_samples = 1 << 12;  // below, a launch is not worth its overhead
constexpr int staged_slots_a_cpu_unit = 1 << 12;
// A state load at most. On GPUs work-items that run side by side wait for the one that scatters most.
constexpr int medium_events = 64, gpu_medium_events = 16;
constexpr int free_queue = QUEUE_FREE;
constexpr std::size_t most_contrast_sums = 1 << 15;  // of a contrast and work-item, where there are many numbers
constexpr int contrasts_at_once = 2;                 // more of them have fewer sets
constexpr std::uint64_t most_texel_sums = std::uint64_t{256} << 20;  // bytes, where each work-item has its own

// The pilot that learns baselines: paths a job; its samples of a pixel begin at pilot_sample, and images leave them
// out.
constexpr int pilot_paths = 1 << 13;

// The counter of random numbers, of 32 bits.
int counter_of(int sample) {
  return sample < Wavefront::pilot_sample ? sample : static_cast<int>(static_cast<unsigned>(sample) + pilot_paths);
}

// A stage as people know it: "rough_dielectric ggx".
std::vector<StageTime> stage_times_of(const LaunchData& data) {
  std::vector<StageTime> times;
  for (const std::string& name : stages_of(data)) times.push_back({name, 0, 0, 0});
  const std::vector<SurfaceKind> kinds = surfaces_of(data);
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    const std::string& variant = kinds[k].model->variants[static_cast<std::size_t>(kinds[k].variant)];
    times[QUEUES_BUT_SURFACES + k].stage = kinds[k].model->name + (variant.empty() ? "" : " " + variant);
  }
  return times;
}

// Baselines pay where paths gather much after their decisions: in media that scatter often. Below, they take less off
// the variance than they add to the time (kernels/README.md, "Quiet derivatives"). In grids they always pay: voxels are
// asked for one by one, and most flights through one know no more of the sky behind it than others do.
constexpr float least_albedo = 0.8F;

// The choice does not depend on which derivatives are asked for: each is the same alone and beside others.
bool with_baselines(const LaunchData& data, Baselines wanted) {
  if (data.cells == 0) return false;
  if (wanted != Baselines::automatic) return wanted == Baselines::on;
  if (!data.fields.empty()) return true;
  return std::any_of(data.media.begin(), data.media.end(), [&](const MediumRecord& m) {
    const float* albedo = data.numbers.data() + m.first_number + HOMOGENEOUS_albedo;
    return *std::max_element(albedo, albedo + 3) >= least_albedo;
  });
}

// The sums of gradients by replay: a slot of a model, in one channel of the throughput or (-1) in all.
std::vector<SumRecord> sums_of(const DerivativeData& derivatives, int throughput_channels) {
  std::vector<SumRecord> sums;
  const auto add = [&](const SumRecord& r) {
    const auto same = [&](const SumRecord& o) { return o.model == r.model && o.at == r.at; };
    if (std::none_of(sums.begin(), sums.end(), same)) sums.push_back(r);
  };
  for (const NumberOfPart& part : derivatives.numbers) {
    if (!part.model || part.model->arrives) continue;  // light is summed where it is met
    for (int k = 0; k < part.components && part.components > 1; ++k)
      add({part.model->id, part.slot + k, -1, part.origin, part.place(k), part.texels});
    if (part.components > 1) continue;
    const bool by_channel = part.colour && throughput_channels == 3;
    for (int c = 0; c < (by_channel ? 3 : 1); ++c)
      add({part.model->id, part.slot + c, by_channel ? c : -1, part.origin, part.place(c), part.texels});
  }
  return sums;
}

// The features for which the program is made, without its schedule.
std::map<std::string, std::string> features(const LaunchData& data, const DerivativeData& derivatives,
                                            Baselines baselines, bool adjoint) {
  std::map<std::string, std::string> result = feature_definitions(data);
  result["BOX_WIDTH"] = std::to_string(data.geometry.box_width);
  result["SCORES"] = std::to_string(derivatives.scores.size());
  for (const ScoreRecord& r : derivatives.scores)
    result["SCORE_RECORDS"] += fmt::format("{{{},{},{},{},{}}},", r.model, r.slot, r.channel, r.first, r.origin);
  result["SCORE_RECORDS"] += "{0,0,0,0,0}";  // an array of length 0 is not C
  result["BASELINES"] = std::to_string((adjoint || !derivatives.scores.empty()) && with_baselines(data, baselines));
  result["ADJOINT"] = std::to_string(adjoint);
  result["surfaces.h"] = surfaces_text(data);
  result["structures.h"] = structures_text(data);
  if (adjoint) {
    const std::vector<SumRecord> sums = sums_of(derivatives, std::stoi(result["THROUGHPUT_CHANNELS"]));
    result["MEDIA"] = std::to_string(data.media.size());
    result["NUMBERS"] = std::to_string(data.numbers.size());
    result["SUMS"] = std::to_string(sums.size());
    const int grids = derivatives.grids();
    result["TEXEL_SUMS"] = std::to_string(static_cast<int>(derivatives.textures.size()) > grids);
    result["VOXEL_SUMS"] = std::to_string(grids);
    result["TEXEL_CHANNELS"] = derivatives.by_directions ? "3" : result["RADIANCE_CHANNELS"];
    result["LIGHT_TEXELS"] = std::to_string(derivatives.by_pictures);
    result["ENVIRONMENT_TEXELS"] = std::to_string(derivatives.by_environment);
    for (const SumRecord& r : sums)
      result["SUM_RECORDS"] +=
          fmt::format("{{{},{},{},{},{},{}}},", r.model, r.slot, r.channel, r.origin, r.at, r.texels);
    result["SUM_RECORDS"] += "{0,0,0,0,0,-1}";
  }
  result["DERIVATIVES"] = std::to_string(derivatives.images());
  result["PARTS"] = std::to_string(derivatives.parts.size());
  for (const PartRecord& p : derivatives.parts)
    result["PART_RECORDS"] += fmt::format("{{{},{{{},{},{}}}}},", p.image, p.score[0], p.score[1], p.score[2]);
  result["PART_RECORDS"] += "{0,{0,0,0}}";
  result["ALBEDOS"] = std::to_string(derivatives.albedos);
  if (derivatives.albedos > 0) result["ALBEDO_SCORE"] = fmt::format("{{{}}}", fmt::join(derivatives.albedo_score, ","));
  result["LIGHT_NUMBERS"] = std::to_string(adjoint ? derivatives.derivatives.size() : 0);
  const bool by_light = std::any_of(derivatives.derivatives.begin(), derivatives.derivatives.end(),
                                    [](const DerivativeRecord& d) { return is_of_light(d); });
  result["HAS_LIGHT_DERIVATIVES"] = std::to_string(by_light);
  return result;
}

}  // namespace

Wavefront::Wavefront(const Device& device, const LaunchData& data, std::vector<JobRecord> jobs,
                     const DerivativeData& derivatives, Operator op, int width, Schedule schedule, Baselines baselines,
                     bool adjoint)
    : device_(device), jobs_(std::move(jobs)), baselines_(baselines), adjoint_(adjoint) {
  width_ = width > 0 ? width : device.default_width();
  const bool cpu = device.info().type == "cpu";
  fused_ = schedule == Schedule::automatic ? cpu : schedule == Schedule::fused;

  features_ = features(data, derivatives, baselines_, adjoint_);
  std::map<std::string, std::string> definitions = features_;
  definitions.erase("surfaces.h");
  definitions.erase("structures.h");
  channels_ = std::stoi(definitions["RADIANCE_CHANNELS"]);
  throughput_channels_ = std::stoi(definitions["THROUGHPUT_CHANNELS"]);
  workers_ = fused_ ? 4 * device.info().compute_units : 1;
  slots_ = fused_ ? fused_slots
           : cpu  ? std::min(staged_slots, staged_slots_a_cpu_unit * device.info().compute_units)
                  : staged_slots;
  if (adjoint_) {
    by_voxels_ = derivatives.grids() > 0;
    texel_channels_ = std::stoi(definitions["TEXEL_CHANNELS"]);
    texels_ = derivatives.texels() * static_cast<std::size_t>(texel_channels_);
    const std::uint64_t room = std::min<std::uint64_t>(most_texel_sums, device.free_memory() / 8);
    own_texels_ = fused_ && static_cast<std::uint64_t>(workers_) * texels_ * sizeof(std::int64_t) <= room;
    definitions["OWN_TEXELS"] = std::to_string(own_texels_ ? texels_ : 0);
  }
  definitions["WIDTH"] = std::to_string(width_);
  definitions["FUSED"] = std::to_string(fused_);
  definitions["SLOTS"] = std::to_string(slots_);
  definitions["GENERATE_BELOW"] = std::to_string(width_);
  definitions["MEDIUM_EVENTS"] = std::to_string(cpu ? medium_events : gpu_medium_events);
  definitions["OPERATOR_SINGLE"] = std::to_string(op == Operator::single);
  program_ =
      device.build("wavefront.cl", definitions,
                   {{"program/scores.h", print_scores(derivatives.functions, throughput_channels_, made_models(data))},
                    {"program/surfaces.h", features_.at("surfaces.h")},
                    {"program/structures.h", features_.at("structures.h")}});
  stages_ = stages_of(data);
  stage_times_ = stage_times_of(data);
  const std::size_t queues = stages_.size();

  buffers_.upload_geometry(device_, data.geometry);
  upload_records(data, derivatives);

  buffers_.visits = device.upload(std::vector<float>(1), "pilot's visits");
  buffers_.pixel_adjoints = device.upload(std::vector<float>(1), "pulls");

  // Short of memory, fewer paths are in flight and launches are smaller: the image is the same.
  const std::size_t bytes_a_slot = (path_fields(definitions).size + queues * (fused_ ? 1u : 2u)) * sizeof(float);
  if (fused_) {
    const std::size_t bytes_a_pool = bytes_a_slot * static_cast<std::size_t>(slots_ + width_);
    const Device::Elements pools =
        device.allocate_most(static_cast<std::size_t>(workers_), 1, bytes_a_pool, "path state");
    workers_ = static_cast<int>(pools.count);
    storage_ = pools.buffer;
  } else {
    const std::size_t dump = static_cast<std::size_t>(width_);
    // Kernels count the floats of all paths in an int: of paths with hundreds of derivatives there are fewer.
    const std::size_t countable = std::numeric_limits<int>::max() / (bytes_a_slot / sizeof(float));
    const std::size_t wanted = std::min(static_cast<std::size_t>(slots_) + dump, countable);
    const Device::Elements slots = device.allocate_most(wanted, least_slots + dump, bytes_a_slot, "path state");
    slots_ = static_cast<int>(slots.count - dump);
    storage_ = slots.buffer;
  }
  counter_ = device.allocate(2 * queues * sizeof(int), "queue lengths");
  buffers_.misplaced = device.upload(std::vector<cl_uint>{0}, "misplaced arrivals");
  buffers_.endless = device.upload(std::vector<cl_uint>{0}, "endless paths");
  floats_a_sample_ = channels_ * (1 + derivatives.images() + derivatives.albedos);
  if (adjoint_ && definitions["BASELINES"] == "1") floats_a_sample_ += throughput_channels_;
  if (by_voxels_) floats_a_sample_ += 1;
  if (adjoint_)
    numbers_ = (data.numbers.size() + derivatives.derivatives.size() + static_cast<std::size_t>(derivatives.grids())) *
               static_cast<std::size_t>(channels_);
  int most_sets = MOST_CONTRAST_SETS;
  while (most_sets > GRADIENT_SETS && static_cast<std::size_t>(most_sets) * numbers_ > most_contrast_sums)
    most_sets /= 2;
  sets_of_contrasts_ = contrasts_at_once * most_sets;
  const auto allocate_sets = [&](int sets) {
    const std::size_t sums = static_cast<std::size_t>(workers_ * sets) * (numbers_ + 1);
    return device_.allocate(sums * sizeof(std::int64_t), "gradient");
  };
  gradient_alone_ = allocate_sets(adjoint_ ? GRADIENT_SETS : 1);
  if (adjoint_) with_contrasts_ = allocate_sets(GRADIENT_SETS + sets_of_contrasts_);
  buffers_.gradient = gradient_alone_;
  buffers_.texel_gradient = device_.allocate(
      std::max(std::size_t{1}, copies_of_texels() * texels_) * sizeof(std::int64_t), "gradient by texels");
  const std::size_t bytes_a_sample = static_cast<std::size_t>(floats_a_sample_) * sizeof(float);
  const std::uint64_t budget = std::min(std::uint64_t{256} << 20, device.info().max_allocation / 4);
  const Device::Elements samples =
      device.allocate_most(budget / bytes_a_sample, least_samples, bytes_a_sample, "samples");
  sample_capacity_ = samples.count;
  buffers_.samples = samples.buffer;
}

void Wavefront::upload_records(const LaunchData& data, const DerivativeData& derivatives) {
  buffers_.upload_scenes(device_, data);
  buffers_.derivatives = device_.upload(derivatives.derivatives, "derivatives");
  has_probes_ = derivatives.has_probes();
  pixels_ = data.pixels;
  cells_ = data.cells;
  learnt_ = features_.at("BASELINES") == "0";  // else the next trace() learns: baselines depend on the material
  buffers_.futures = device_.upload(
      std::vector<float>(learnt_ ? 1 : static_cast<std::size_t>(cells_ * throughput_channels_)), "expected futures");
}

bool Wavefront::replace(const LaunchData& data, std::vector<JobRecord> jobs, const DerivativeData& derivatives,
                        bool new_geometry) {
  if (features(data, derivatives, baselines_, adjoint_) != features_) return false;
  if (new_geometry) buffers_.upload_geometry(device_, data.geometry);
  upload_records(data, derivatives);
  jobs_ = std::move(jobs);
  return true;
}

void Wavefront::reseed(std::uint64_t seed) {
  for (JobRecord& job : jobs_) {
    job.seed_low = static_cast<unsigned>(seed);
    job.seed_high = static_cast<unsigned>(seed >> 32);
  }
  learnt_ = features_.at("BASELINES") == "0";
}

// The device's counters are of 32 bits, and no launch adds as many.
void Wavefront::count_faults() {
  const auto count = [&](const cl::Buffer& counter, std::uint64_t& all) {
    std::vector<cl_uint> now(1);
    device_.download(counter, now);
    all += now[0] - static_cast<cl_uint>(all);
  };
  count(buffers_.misplaced, faults_.misplaced);
  count(buffers_.endless, faults_.endless);
}

std::vector<StageTime> Wavefront::stage_times() const {
  std::vector<StageTime> ran;
  std::copy_if(stage_times_.begin(), stage_times_.end(), std::back_inserter(ran),
               [](const StageTime& stage) { return stage.launches > 0; });
  return ran;
}

void Wavefront::trace(const std::vector<JobSlice>& slices, std::size_t at) {
  if (!learnt_) learn_baselines();
  trace_jobs(slices, Purpose::samples, at);
}

void Wavefront::begin_gradient(int contrasts) {
  summing_ = false;
  contrasts_ = contrasts;
  if (contrasts > 0)
    contrast_sets_ = static_cast<int>(std::bit_floor(static_cast<unsigned>(sets_of_contrasts_ / contrasts)));
  buffers_.gradient = contrasts > 0 ? with_contrasts_ : gradient_alone_;
}

void Wavefront::replay(const std::vector<JobSlice>& slices, const std::vector<float>& pulls, std::size_t at,
                       int contrast) {
  if (!summing_) clear_gradient();
  buffers_.pixel_adjoints = device_.upload(pulls, "pulls");
  contrast_ = contrast;
  trace_jobs(slices, Purpose::replay, at);
  for (int probe = 0; has_probes_ && probe < PROBES; ++probe) trace_jobs(slices, Purpose::probes, at, probe);
}

// Clears the sums of all work-items: each has a gradient of its own, but for that by texels.
void Wavefront::clear_gradient() {
  device_.clear(buffers_.gradient);
  if (texels_ > 0) device_.clear(buffers_.texel_gradient);
  summing_ = true;
}

std::vector<std::int64_t> Wavefront::take_gradient() {
  const std::size_t size = sets() * (numbers_ + 1);
  std::vector<std::int64_t> all(size * static_cast<std::size_t>(workers_)), sum(size);
  if (!std::exchange(summing_, false)) return sum;
  device_.download(buffers_.gradient, all);
  for (std::size_t i = 0; i < all.size(); ++i) sum[i % size] += all[i];
  return sum;
}

void Wavefront::look_at_texel_gradient(const std::function<void(const std::int64_t* sums)>& use) const {
  if (texels_ == 0 || !summing_) return use(std::vector<std::int64_t>(texels_).data());
  const std::size_t copies = copies_of_texels();
  device_.look_at(buffers_.texel_gradient, copies * texels_ * sizeof(std::int64_t), [&](const void* data) {
    const auto* const of_copies = static_cast<const std::int64_t*>(data);
    if (copies == 1) return use(of_copies);
    std::vector<std::int64_t> sums(of_copies, of_copies + texels_);
    for (std::size_t i = texels_; i < copies * texels_; ++i) sums[i % texels_] += of_copies[i];
    use(sums.data());
  });
}

// A pilot of every job: pixels spread evenly over its film, and samples that no image takes.
void Wavefront::learn_baselines() {
  learnt_ = true;
  BaselineTable table(cells_, throughput_channels_, channels_);
  const auto a_path = static_cast<std::size_t>(BASELINE_VISITS * BASELINE_VISIT_SIZE(throughput_channels_, channels_));
  const std::uint64_t room = device_.free_memory() / 2 / (a_path * sizeof(float));
  const int most = static_cast<int>(std::clamp<std::uint64_t>(room, 64, pilot_paths));  // paths a launch
  std::vector<float> samples;
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    // The same paths in the same order whatever the memory: the table's sums are the same to the bit.
    const int on_film = pixels_[static_cast<std::size_t>(jobs_[j].camera)];
    const int step = (on_film + pilot_paths - 1) / pilot_paths | 1;  // odd: other columns in the next row
    const int pixels = (on_film + step - 1) / step, a_pixel = std::max(1, pilot_paths / pixels);
    const int run = std::max(1, most / a_pixel), at_once = std::min(a_pixel, most);
    for (int first = 0; first < pixels; first += run)
      for (int sample = 0; sample < a_pixel; sample += at_once) {
        const JobSlice slice{.job = static_cast<int>(j),
                             .first_pixel = first * step,
                             .pixels = std::min(run, pixels - first),
                             .first_sample = pilot_sample + sample,
                             .samples = std::min(at_once, a_pixel - sample),
                             .pixel_step = step};
        const auto paths = static_cast<std::size_t>(slice.pixels * slice.samples);
        buffers_.visits = cl::Buffer();  // its memory first
        buffers_.visits = device_.allocate_zeroed(paths * a_path * sizeof(float), "pilot's visits");
        trace_jobs({slice}, Purpose::pilot);
        samples.resize(paths * static_cast<std::size_t>(floats_a_sample_));
        device_.download(buffers_.samples, samples);
        device_.look_at(buffers_.visits, paths * a_path * sizeof(float), [&](const void* visits) {
          table.add(samples, floats_a_sample_, {static_cast<const float*>(visits), paths * a_path});
        });
      }
    const std::array<float, 3> tint = table.take_tint();
    std::copy(tint.begin(), tint.end(), jobs_[j].future_tint);
  }
  buffers_.futures = device_.upload(table.futures(), "expected futures");
  buffers_.visits = device_.upload(std::vector<float>(1), "pilot's visits");
}

void Wavefront::trace_jobs(const std::vector<JobSlice>& slices, Purpose purpose, std::size_t at, int probe) {
  std::vector<JobRecord> jobs;
  int paths = 0, pulled_pixels = 0;
  for (const JobSlice& slice : slices) {
    JobRecord job = jobs_[static_cast<std::size_t>(slice.job)];
    job.first_pixel = slice.first_pixel;
    job.pixel_step = slice.pixel_step;
    job.first_sample = purpose == Purpose::pilot ? slice.first_sample : counter_of(slice.first_sample);
    job.samples = slice.samples;
    job.first_output = static_cast<int>(at) + paths;
    job.pilot = purpose == Purpose::pilot;
    job.replay = purpose == Purpose::replay ? REPLAY_SUMS : purpose == Purpose::probes ? REPLAY_PROBES : 0;
    job.first_pixel_adjoint = pulled_pixels;
    job.probe = probe;
    job.sets = static_cast<int>(sets());
    job.contrast = contrast_ >= 0;
    job.first_set = job.contrast ? GRADIENT_SETS + contrast_ * contrast_sets_ : 0;
    job.set_mask = (job.contrast ? contrast_sets_ : GRADIENT_SETS) - 1;
    pulled_pixels += slice.pixels;
    jobs.push_back(job);
    paths += slice.pixels * slice.samples;
  }
  if (at + static_cast<std::size_t>(paths) > sample_capacity_)
    throw std::logic_error("more samples than a launch can hold");
  // long enough that a pool's start and end do not matter, short enough that all workers end together; in whole groups,
  // so that a bundle of camera rays is of one pixel
  constexpr int groups = 64;  // lanes, a multiple of any width
  const int most = std::clamp(paths / (8 * std::max(1, device_.info().compute_units)) / groups * groups, 1024, 32768);
  std::vector<ChunkRecord> chunks;
  int start = 0;
  for (int j = 0; j < static_cast<int>(slices.size()); ++j) {
    const int count = slices[static_cast<std::size_t>(j)].pixels * slices[static_cast<std::size_t>(j)].samples;
    for (int first = 0; first < count; first += most) {
      const int length = std::min(most, count - first);
      chunks.push_back({j, first, length, start});
      start += length;
    }
  }
  buffers_.jobs = device_.upload(jobs, "jobs");
  if (fused_)
    trace_fused(chunks);
  else
    trace_staged(chunks, paths);
  count_faults();
}

void Wavefront::trace_fused(const std::vector<ChunkRecord>& chunks) {
  const cl::Buffer chunk_buffer = device_.upload(chunks, "chunks");
  counter_ = device_.upload(std::vector<int>{0}, "chunk counter");
  cl::Kernel kernel(program_, "trace_paths");
  cl_uint at = buffers_.set_arguments(kernel);
  kernel.setArg(at++, chunk_buffer);
  kernel.setArg(at++, static_cast<cl_int>(chunks.size()));
  kernel.setArg(at++, counter_);
  kernel.setArg(at++, storage_);
  device_.launch(kernel, static_cast<std::size_t>(workers_), 1);
  device_.finish();
}

void Wavefront::trace_staged(const std::vector<ChunkRecord>& chunks, int paths) {
  const cl::Buffer chunk_buffer = device_.upload(chunks, "chunks");
  const int slots = std::min(slots_, paths);  // of the pool that this launch uses
  const auto launch = [&](const cl::Kernel& kernel, int items) {
    device_.launch_at_least(kernel, static_cast<std::size_t>(items));
  };
  const auto launch_stage = [&](const cl::Kernel& kernel, int queue, int items, int waiting_paths) {
    if (!timed_) return launch(kernel, items);
    device_.finish();
    const auto start = std::chrono::steady_clock::now();
    launch(kernel, items);
    device_.finish();
    StageTime& time = stage_times_[static_cast<std::size_t>(queue)];
    time.seconds += seconds_since(start);
    time.launches += 1;
    time.paths += static_cast<std::uint64_t>(waiting_paths);
  };
  cl::Kernel fill(program_, "fill_free_queue"), generate(program_, "generate"), reset(program_, "reset_queues");
  fill.setArg(0, storage_);
  fill.setArg(1, static_cast<cl_int>(slots));
  fill.setArg(2, counter_);
  launch(fill, slots);

  const int queues = static_cast<int>(stages_.size());
  std::vector<cl::Kernel> stages(stages_.size());  // made when first needed: a program lacks those of unused queues
  const auto stage_of = [&](int queue) -> cl::Kernel& {
    cl::Kernel& stage = stages[static_cast<std::size_t>(queue)];
    if (stage()) return stage;
    stage = cl::Kernel(program_, stages_[static_cast<std::size_t>(queue)].c_str());
    cl_uint at = buffers_.set_arguments(stage);
    stage.setArg(at++, storage_);
    stage.setArg(at++, static_cast<cl_int>(slots));
    stage.setArg(at, counter_);
    return stage;
  };
  const cl_uint after_scene = buffers_.set_arguments(generate);
  std::vector<int> lengths(2 * stages_.size());
  int next = 0;
  for (int half = 0;; half = 1 - half) {
    device_.download(counter_, lengths);
    const int* length = lengths.data() + half * queues;
    int waiting = 0;
    for (int q = 1; q < queues; ++q) waiting += length[q];
    if (waiting == 0 && next >= paths) return;
    if (next < paths) {
      cl_uint at = after_scene;
      generate.setArg(at++, chunk_buffer);
      generate.setArg(at++, static_cast<cl_int>(chunks.size()));
      generate.setArg(at++, static_cast<cl_int>(next));
      generate.setArg(at++, static_cast<cl_int>(paths));
      generate.setArg(at++, storage_);
      generate.setArg(at++, static_cast<cl_int>(slots));
      generate.setArg(at++, counter_);
      generate.setArg(at++, static_cast<cl_int>(half));
      const int starting = std::min(length[free_queue], paths - next);
      launch_stage(generate, free_queue, (length[free_queue] + width_ - 1) / width_, starting);
      next += starting;
    }
    for (int q = 1; q < queues; ++q) {
      if (length[q] == 0) continue;
      cl::Kernel& stage = stage_of(q);
      stage.setArg(after_scene + 3, static_cast<cl_int>(half));
      launch_stage(stage, q, (length[q] + width_ - 1) / width_, length[q]);
    }
    reset.setArg(0, counter_);
    reset.setArg(1, static_cast<cl_int>(half));
    device_.launch(reset, static_cast<std::size_t>(queues), 1);
  }
}

}  // namespace itn
