#include "tools/itn/invert_textures.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/base/seconds_since.h"
#include "runtime/image/png.h"
#include "runtime/image/preview.h"
#include "runtime/image/srgb.h"
#include "runtime/inverse/textures/stored_texture_inversion.h"
#include "runtime/scene/volume/volume_file.h"
#include "tools/itn/progress.h"

namespace itn::tools {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> letters(int channels) {
  return channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
}

// As scenes read it again: colours in sRGB; numbers as they are, for a texture with raw = true. Light from all around,
// which may be much brighter than white: as images of scenes are drawn.
std::vector<std::uint8_t> bytes_of(const VoxelGrid& bitmap, const Parameter& parameter) {
  if (parameter.owner == Owner::environment) return tone_mapped(bitmap.data, bitmap.channels);
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < bitmap.data.size(); ++i) {
    const double v = std::clamp(static_cast<double>(bitmap.data[i]), 0.0, 1.0);
    const auto byte = static_cast<std::uint8_t>(std::lround(255 * (bitmap.channels == 1 ? v : srgb_encode(v))));
    bytes.insert(bytes.end(), bitmap.channels == 1 ? 3 : 1, byte);
  }
  return bytes;
}

Json write_grid(const std::string& file, const VoxelGrid& grid) {
  write_volume_file(file + ".vol", grid);
  return {{"file", file + ".vol"},
          {"width", grid.width},
          {"height", grid.height},
          {"depth", grid.depth},
          {"channels", letters(grid.channels)}};
}

void write_picture(const std::string& file, const VoxelGrid& bitmap, const TextureQuestion& question,
                   const Parameter& parameter, const std::vector<std::uint8_t>& bytes) {
  write_exr(file + ".exr", {bitmap.width,
                            bitmap.height,
                            letters(bitmap.channels),
                            bitmap.data,
                            {{"scene", question.scene}, {"parameter", parameter.name}}});
  write_png(file + ".png", bitmap.width, bitmap.height, bytes);
}

Json write_texture(const std::string& file, const VoxelGrid& bitmap, const TextureQuestion& question,
                   const Parameter& parameter) {
  write_picture(file, bitmap, question, parameter, bytes_of(bitmap, parameter));
  return {{"file", file + ".exr"},
          {"picture", file + ".png"},
          {"width", bitmap.width},
          {"height", bitmap.height},
          {"channels", letters(bitmap.channels)}};
}

// Its picture is white where the standard error is the greatest, or not known.
Json write_uncertainty(const std::string& file, const VoxelGrid& errors, const TextureQuestion& question,
                       const Parameter& parameter) {
  double greatest = 0, square = 0, known = 0;
  for (const float v : errors.data) {
    if (!std::isfinite(v)) continue;
    greatest = std::max(greatest, static_cast<double>(v));
    square += static_cast<double>(v) * static_cast<double>(v);
    ++known;
  }
  std::vector<std::uint8_t> bytes;
  for (const float v : errors.data) {
    const double share = std::isfinite(v) ? static_cast<double>(v) / std::max(greatest, 1e-30) : 1;
    bytes.insert(bytes.end(), errors.channels == 1 ? 3 : 1, static_cast<std::uint8_t>(std::lround(255 * share)));
  }
  write_picture(file, errors, question, parameter, bytes);
  return {{"file", file + ".exr"},
          {"picture", file + ".png"},
          {"white", greatest},
          {"rms", known > 0 ? Json(std::sqrt(square / known)) : Json()},
          {"unseen", errors.data.size() - static_cast<std::size_t>(known)}};
}

// As of an inversion of numbers.
Json number_found(const TextureInversion& inversion, const TextureInversionState& state, std::size_t p, bool known,
                  bool holds) {
  Json result{{"value", inversion.number(state, p)}};
  if (!known) return result;
  const double low = inversion.number(state, p, -1.96), high = inversion.number(state, p, 1.96);
  result["low"] = low;
  result["high"] = high;
  result["stderr"] = (high - low) / (2 * 1.96);
  result["holds"] = holds;
  return result;
}

// Writes the rendering with the textures beside the target.
void write_images(const StoredTextureInversion& stored, const std::string& number, const Rendering& image,
                  const TargetImage& target) {
  std::vector<float> residual(image.mean.size());
  for (std::size_t i = 0; i < residual.size(); ++i)
    residual[i] =
        target.weight[i / static_cast<std::size_t>(image.channels)] > 0 ? image.mean[i] - target.value[i] : 0.0F;
  write_exr(stored.file("rerender" + number + ".exr"),
            {image.width, image.height, letters(image.channels), image.mean, {}});
  const auto picture = [&](const std::string& name, const std::vector<std::uint8_t>& bytes) {
    write_png(stored.file(name + number + ".png"), image.width, image.height, bytes);
  };
  picture("rerender", tone_mapped(image.mean, image.channels));
  picture("target", tone_mapped(target.value, image.channels));
  picture("residual", red_blue(residual, image.channels).bytes);
}

void print_step(const TextureInversionStep& step, const TextureInversionOptions& how) {
  fmt::print("{}iteration {:3}  {:4} spp  loss {:.4g}{}\n",
             step.repeat > 0 ? fmt::format("repetition {}  ", step.repeat) : "", step.iteration, how.spp, step.loss,
             how.smoothness > 0 ? fmt::format("  roughness {:.4g}", step.roughness) : "");
  std::fflush(stdout);
}

}  // namespace

bool names_texture(const std::vector<Parameter>& all, const std::vector<std::string>& names) {
  return std::any_of(all.begin(), all.end(), [&](const Parameter& p) {
    return p.has_values() && std::find(names.begin(), names.end(), p.name) != names.end();
  });
}

void invert_textures(const TextureQuestion& question, const Scene& scene, const std::vector<TargetImage>& targets,
                     const Device& device, const RenderOptions& render_options, const StoredRun::Json& request) {
  const CommonOptions& common = question.common;
  const TextureInversionOptions& how = question.inversion;
  const auto seconds = [start = std::chrono::steady_clock::now()] { return seconds_since(start); };
  if (how.spp < 2) throw UsageError("--spp 1: a loss compares different samples of a pixel; need 2 or more");
  check_outputs(common, {});
  TextureInversion inversion(device, scene, question.parameters, question.images.sensors, targets, render_options, how);
  StoredTextureInversion stored(question.folder, request, inversion);
  Progress progress(question.scene, inversion.steps(), "iterations", !common.quiet);
  while (!stored.state().finished) {
    const TextureInversionStep& step = stored.advance();
    progress.clear();
    if (common.talkative()) print_step(step, how);
    progress.update(static_cast<double>(stored.steps().size()) / inversion.steps());
  }
  progress.clear();

  const TextureImages seen = inversion.render(stored.state());
  const LossGradient& loss = seen.loss;
  for (std::size_t t = 0; t < targets.size(); ++t)
    write_images(stored, targets.size() == 1 ? "" : "_" + std::to_string(t), seen.images[t], targets[t]);
  Json textures = Json::object(), numbers = Json::object();
  const std::vector<Parameter> parameters = inversion.parameters();
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const Parameter& parameter = parameters[p];
    if (!parameter.has_values()) {
      numbers[parameter.name] = number_found(inversion, stored.state(), p, how.repeats > 0, seen.fit());
      continue;
    }
    const std::string file = stored.file(parameter.name);
    Json& texture = textures[parameter.name];
    const VoxelGrid values = inversion.values(stored.state(), p);
    if (parameter.by_voxels) {
      texture = write_grid(file, values);
      if (how.repeats > 0) {
        write_volume_file(file + ".uncertainty.vol", inversion.uncertainty(stored.state(), p));
        texture["uncertainty"] = {{"file", file + ".uncertainty.vol"}, {"holds", seen.fit()}};
      }
      continue;
    }
    texture = write_texture(file, values, question, parameter);
    if (how.repeats == 0) continue;
    texture["uncertainty"] =
        write_uncertainty(file + ".uncertainty", inversion.uncertainty(stored.state(), p), question, parameter);
    texture["uncertainty"]["holds"] = seen.fit();
  }
  const std::string wrong = words(seen);
  const Json result{{"schema", "itn.invert/1"},
                    {"scene", question.scene},
                    {"method", "adam"},
                    {"converged", seen.fit()},
                    {"fit", to_json(seen.comparison.fit)},
                    {"misfit", to_json(seen.comparison.misfit)},
                    {"parameters", numbers},
                    {"textures", textures},
                    {"ambiguity", Json::array()},
                    {"loss", loss.loss},
                    {"loss_stderr", std::isfinite(loss.loss_stderr) ? Json(loss.loss_stderr) : Json()},
                    {"loss_at_start", stored.steps().front().loss},
                    {"iterations", how.iterations},
                    {"repeats", how.repeats},
                    {"verdict", {wrong}},
                    {"time", {{"total_s", seconds()}}}};
  write_file(stored.file("result.json"), result.dump(2) + "\n");
  if (common.talkative()) {
    fmt::print("loss {:.4g} +- {:.2g}, at the start {:.4g}\n", loss.loss, loss.loss_stderr,
               stored.steps().front().loss);
    for (const auto& [name, number] : numbers.items())
      fmt::print("{:<24} {:>10.5g}{}\n", name, number["value"].get<double>(),
                 number.contains("low")
                     ? fmt::format("   95 %: {:.5g} to {:.5g}{}", number["low"].get<double>(),
                                   number["high"].get<double>(), seen.fit() ? "" : " (does not hold)")
                     : "");
    for (const auto& [name, texture] : textures.items())
      fmt::print("{}: {}\n", name, texture["file"].get<std::string>());
    fmt::print("{}{}\n", seen.fit() ? "" : "NOT converged: ", wrong);
  }
  write_json(common, result);
  if (!seen.fit())
    throw ResultError(fmt::format("invert: not converged: {} {} shows how far", wrong, stored.file("result.json")));
}

}  // namespace itn::tools
