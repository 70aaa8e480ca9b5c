#include "tools/itn/view_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/save_scene.h"
#include "runtime/base/json_text.h"
#include "runtime/image/png.h"
#include "runtime/image/preview.h"
#include "runtime/view/slider.h"
#include "tools/itn/rendered_exr.h"

namespace itn {

const char* view_file(const std::string& path);  // embedded by CMake

namespace tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr auto frame_wait = std::chrono::milliseconds(2000);
constexpr int settled_spp = 16;  // a picture of fewer samples says little about its brightest places
constexpr double most_stops = 10;

// Infinities and NaN become null.
std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

WebResponse as_json(const Json& json, int status = 200) { return {status, "application/json", dumped(json), ""}; }

WebResponse failure(int status, const std::string& text) { return as_json({{"error", text}}, status); }

std::uint64_t whole_number(const WebRequest& request, const std::string& name) {
  const auto given = request.query.find(name);
  std::uint64_t value = 0;
  if (given != request.query.end())
    std::from_chars(given->second.data(), given->second.data() + given->second.size(), value);
  return value;
}

// Throws InputError or nlohmann's exceptions: no JSON, no object, or a member twice.
Json object_of(const std::string& body) {
  Json json = parse_json<Json>(body, "the request");
  if (!json.is_object()) throw UsageError(std::string("got JSON of type ") + json.type_name() + ", need an object");
  return json;
}

// bool would become 0 or 1.
double number_of(const std::string& name, const Json& value) {
  if (!value.is_number()) throw UsageError(fmt::format("{}: got {}, need a number", name, dumped(value).substr(0, 80)));
  return value.get<double>();
}

// The standard error of a pixel over the mean of the image, root mean square.
double relative_noise(const Rendering& image) {
  double square = 0, mean = 0;
  for (const float error : image.stderr_) square += static_cast<double>(error) * static_cast<double>(error);
  for (const double m : image.mean_of_image) mean += m / static_cast<double>(image.mean_of_image.size());
  return std::sqrt(square / static_cast<double>(image.stderr_.size())) / mean;
}

std::vector<float> residual_of(const Rendering& image, const TargetImage& target, double exposure) {
  std::vector<float> residual(target.value.size());
  for (std::size_t i = 0; i < residual.size(); ++i)
    if (target.weight[i / static_cast<std::size_t>(target.channels)] > 0)
      residual[i] = static_cast<float>(exposure) * image.mean[i] - target.value[i];
  return residual;
}

// For the eye: the mean over 3 x 3 pixels, less what of it may be noise. A number d with the standard error e becomes
// d (1 - e^2 / d^2), which is Wiener's filter where only d tells how large the signal is; 0 below one standard error.
std::vector<float> denoised(const Image& derivative, int width, int height, int channels) {
  std::vector<float> result(derivative.mean.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      // Channels share their paths, and so their noise; pixels do not.
      double sum = 0, square = 0;
      for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u) {
          double error = 0;
          for (int c = 0; c < channels; ++c) {
            const auto i = static_cast<std::size_t>((v * width + u) * channels + c);
            sum += static_cast<double>(derivative.mean[i]);
            error += static_cast<double>(derivative.stderr_[i]);
          }
          square += error * error;
        }
      const double share = square < sum * sum ? 1 - square / (sum * sum) : 0;
      const int around = (std::min(height - 1, y + 1) - std::max(0, y - 1) + 1) *
                         (std::min(width - 1, x + 1) - std::max(0, x - 1) + 1);
      const auto first = result.begin() + static_cast<std::ptrdiff_t>((y * width + x) * channels);
      std::fill_n(first, channels, static_cast<float>(sum * share / (around * channels)));
    }
  return result;
}

Json to_json(const ViewStep& step) {
  Json values = Json::object();
  for (std::size_t i = 0; i < step.parameters.size(); ++i)
    values[step.parameters[i]] = {{"from", step.from[i]}, {"to", step.to[i]}};
  return {{"values", values}, {"distance", step.distance}, {"settled", step.settled}, {"misfit", step.misfit}};
}

Json describe(const Parameter& p) {
  const Slider slider = slider_of(p);
  return {{"name", p.name},
          {"id", p.id},
          {"label", p.name.substr(std::min(p.name.size(), p.id.size() + 1))},
          {"value", p.value},
          {"low", p.low},
          {"high", p.high},
          {"range", p.range()},
          {"unit", p.unit},
          {"not_differentiable", p.not_differentiable},
          {"slider", {{"scale", name_of(slider.scale)}, {"low", slider.low}, {"high", slider.high}}}};
}

// Numbers first in the answer: the length of the JSON in four bytes, the lowest first.
std::string with_pictures(const Json& json, const std::vector<std::vector<std::uint8_t>>& pictures) {
  const std::string text = dumped(json);
  std::string body;
  for (int byte = 0; byte < 4; ++byte) body += static_cast<char>(text.size() >> (8 * byte) & 0xff);
  body += text;
  for (const std::vector<std::uint8_t>& picture : pictures) body.append(picture.begin(), picture.end());
  return body;
}

}  // namespace

double ViewPage::Look::exposure() const { return automatic * std::exp2(stops); }

ViewPage::ViewPage(ViewSession& session, ViewedScene scene) : session_(session), scene_(std::move(scene)) {
  if (const auto& target = session_.options().target) {
    look_.automatic = automatic_exposure(target->value, target->channels);
    settled_ = true;
  }
}

ViewPage::Look ViewPage::look_at(const ViewFrame& frame) {
  const std::lock_guard lock(mutex_);
  if (!settled_ && frame.image.spp > 0) {
    look_.automatic = automatic_exposure(frame.image.mean, frame.image.channels);
    ++look_.number;
    settled_ = frame.image.spp >= settled_spp || frame.revision > 1;
  }
  return look_;
}

std::string ViewPage::file_name(const std::string& ending) const {
  std::string name = std::filesystem::path(scene_.file).stem().string();
  for (char& c : name)
    if (!(std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.')) c = '_';
  return name + "-view" + ending;
}

WebResponse ViewPage::parameters() const {
  Json list = Json::array();
  for (const Parameter& p : session_.parameters()) list.push_back(describe(p));
  const Sensor& sensor = session_.sensor();
  return as_json({{"scene", std::filesystem::path(scene_.file).filename().string()},
                  {"device", session_.device().info().name},
                  {"width", sensor.crop_width},
                  {"height", sensor.crop_height},
                  {"spp", session_.options().spp},
                  {"target", session_.options().target.has_value()},
                  {"parameters", list}});
}

// The frame: its numbers, then pictures of three bytes a pixel as "pictures" lists them. The photo comes only where the
// page has another look (number of Look) or none of it.
WebResponse ViewPage::frame(const WebRequest& request) {
  const std::shared_ptr<const ViewFrame> shown = session_.wait(whole_number(request, "after"), frame_wait);
  const Look look = look_at(*shown);
  const Rendering& image = shown->image;
  Json json{{"number", shown->number},
            {"revision", shown->revision},
            {"look", look.number},
            {"exposure", look.stops},
            {"spp", image.spp},
            {"done", shown->done},
            {"fit", session_.fitted()},
            {"problem", shown->problem},
            {"derivative_note", shown->derivative_note},
            {"step_note", shown->step_note}};
  Json values = Json::array();
  for (const double v : shown->values) values.push_back(v);
  json["values"] = values;
  std::vector<std::vector<std::uint8_t>> pictures;
  Json names = Json::array();
  if (image.spp > 0) {
    json["noise"] = relative_noise(image);
    pictures.push_back(tone_mapped(image.mean, image.channels, look.exposure() * shown->exposure));
    names.push_back("image");
    if (!image.derivatives.empty()) {
      SignedPicture derivative =
          red_blue(denoised(image.derivatives.front(), image.width, image.height, image.channels), image.channels);
      json["derivative"] = {{"parameter", shown->derivative},
                            {"scale", derivative.scale},
                            {"mean", image.derivatives.front().mean_of_image},
                            {"stderr", Json::array()}};
      for (const double e : image.derivatives.front().stderr_of_mean) json["derivative"]["stderr"].push_back(e);
      pictures.push_back(std::move(derivative.bytes));
      names.push_back("derivative");
    }
  }
  if (const auto& target = session_.options().target; target && image.spp > 0) {
    SignedPicture residual = red_blue(residual_of(image, *target, shown->exposure), target->channels);
    json["residual_scale"] = residual.scale;
    pictures.push_back(std::move(residual.bytes));
    names.push_back("residual");
    if (whole_number(request, "look") != look.number) {
      pictures.push_back(tone_mapped(target->value, target->channels, look.exposure()));
      names.push_back("photo");
    }
    if (shown->loss) {
      json["loss"] = {{"value", shown->loss->loss}, {"stderr", shown->loss->loss_stderr}};
      if (session_.options().exposure) json["loss"]["exposure"] = shown->exposure;
      if (!shown->loss->gradient.empty()) {
        json["loss"]["gradient"] = shown->loss->gradient.front();
        json["loss"]["gradient_stderr"] = shown->loss->gradient_stderr.front();
      }
    }
    if (shown->step) json["step"] = to_json(*shown->step);
  }
  json["pictures"] = names;
  return {200, "application/octet-stream", with_pictures(json, pictures), ""};
}

WebResponse ViewPage::set(const std::string& body) {
  std::map<std::string, double> values;
  const Json given = object_of(body);
  for (const auto& [name, value] : given.items()) values[name] = number_of(name, value);
  return as_json({{"revision", session_.set(values)}});
}

WebResponse ViewPage::look(const std::string& body) {
  const Json json = object_of(body);
  for (const auto& [name, value] : json.items())
    if (name != "derivative" && name != "fit" && name != "exposure")
      throw UsageError(fmt::format("{}: need derivative, fit or exposure", name));
  const auto d = json.find("derivative"), f = json.find("fit"), e = json.find("exposure");
  const bool automatic = e == json.end() || *e == "automatic";
  const double stops = automatic ? 0 : number_of("exposure", *e);
  if (d != json.end()) session_.differentiate(d->get<std::string>());
  if (f != json.end()) session_.fit(f->get<std::vector<std::string>>());
  if (e != json.end()) {
    const std::shared_ptr<const ViewFrame> shown = session_.frame();
    const std::lock_guard lock(mutex_);
    look_.stops = std::clamp(stops, -most_stops, most_stops);
    if (automatic && shown->image.spp > 0)
      look_.automatic = automatic_exposure(shown->image.mean, shown->image.channels);
    ++look_.number;
  }
  return as_json(Json::object());
}

WebResponse ViewPage::scene_file() {
  const std::string text =
      scene_text(scene_.file, scene_.definitions, scene_.options, session_.parameters(), session_.values());
  return {200, "application/xml", text, file_name(".xml")};
}

WebResponse ViewPage::exr_file() {
  const std::shared_ptr<const ViewFrame> shown = session_.frame();
  if (shown->image.spp == 0) return failure(409, "there is no image yet");
  RenderedExr about{scene_.file, {}, session_.options().seed, session_.options().op};
  if (!shown->image.derivatives.empty()) about.derivatives.push_back(shown->derivative);
  const ExrImage exr = to_exr(shown->image, session_.scene_of(*shown), about, session_.device());
  const std::string name = file_name(".exr");
  return {200, "image/x-exr", encode_exr(name, exr), name};
}

WebResponse ViewPage::png_file() {
  const std::shared_ptr<const ViewFrame> shown = session_.frame();
  if (shown->image.spp == 0) return failure(409, "there is no image yet");
  const Rendering& image = shown->image;
  const std::string name = file_name(".png");
  return {200, "image/png",
          encode_png(name, image.width, image.height,
                     tone_mapped(image.mean, image.channels, look_at(*shown).exposure() * shown->exposure)),
          name};
}

WebResponse ViewPage::dispatch(const WebRequest& request) {
  const auto is = [&](const char* method, const char* path) {
    return request.method == method && request.path == path;
  };
  if (is("GET", "/")) return {200, "text/html; charset=utf-8", view_file("index.html"), ""};
  if (is("GET", "/view.css")) return {200, "text/css; charset=utf-8", view_file("view.css"), ""};
  if (is("GET", "/view.js")) return {200, "text/javascript; charset=utf-8", view_file("view.js"), ""};
  if (is("GET", "/icon.svg")) return {200, "image/svg+xml", view_file("icon.svg"), ""};
  if (is("GET", "/parameters")) return parameters();
  if (is("GET", "/frame")) return frame(request);
  if (is("GET", "/scene.xml")) return scene_file();
  if (is("GET", "/image.exr")) return exr_file();
  if (is("GET", "/image.png")) return png_file();
  if (is("POST", "/set")) return set(request.body);
  if (is("POST", "/look")) return look(request.body);
  if (is("POST", "/step")) return as_json({{"taken", session_.take_step()}});
  return failure(404, "there is nothing of this name here");
}

WebResponse ViewPage::answer(const WebRequest& request) {
  try {
    return dispatch(request);
  } catch (const UsageError& error) {
    return failure(400, error.what());
  } catch (const InputError& error) {
    return failure(400, error.what());
  } catch (const nlohmann::json::exception& error) {
    return failure(400, std::string("this is not the JSON that was expected: ") + error.what());
  } catch (const std::exception& error) {
    return failure(500, error.what());
  }
}

}  // namespace tools
}  // namespace itn
