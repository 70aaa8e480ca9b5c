// itn devices: what can render here.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "itn/device.h"
#include "itn/error.h"
#include "runtime/render/device/driver_faults.h"
#include "tools/itn/common.h"

namespace itn::tools {
namespace {

void print(const DeviceInfo& d) {
  fmt::print("{}  {}\n", d.index, d.name);
  fmt::print("   platform       {}\n", d.platform);
  fmt::print("   type           {}\n", d.type);
  fmt::print("   driver         {} ({})\n", d.driver, d.version);
  fmt::print("   memory         {:.1f} GiB, at most {:.1f} GiB a buffer\n", static_cast<double>(d.memory) / (1 << 30),
             static_cast<double>(d.max_allocation) / (1 << 30));
  fmt::print("   compute units  {}\n", d.compute_units);
  fmt::print("   vector width   {} floats\n", d.preferred_width);
  fmt::print("   usable         {}\n", d.unusable.empty() ? "yes" : "no: " + d.unusable);
}

nlohmann::ordered_json to_json(const DeviceInfo& d) {
  return {{"index", d.index},
          {"platform", d.platform},
          {"name", d.name},
          {"type", d.type},
          {"vendor", d.vendor},
          {"driver", d.driver},
          {"version", d.version},
          {"memory", d.memory},
          {"max_allocation", d.max_allocation},
          {"compute_units", d.compute_units},
          {"vector_width", d.preferred_width},
          {"usable", d.unusable.empty()},
          {"reason", d.unusable}};
}

void run(const CommonOptions& options) {
  const std::vector<DeviceInfo> devices = list_devices();
  nlohmann::ordered_json result{{"schema", "itn.devices/1"}, {"devices", nlohmann::ordered_json::array()}};
  for (const DeviceInfo& device : devices) {
    if (options.talkative()) print(device);
    result["devices"].push_back(to_json(device));
  }
  write_json(options, result);
  if (devices.empty()) throw DeviceError(no_device_reason());
}

}  // namespace

void add_devices(CLI::App& app) {
  auto options = std::make_shared<CommonOptions>();
  CLI::App* command = app.add_subcommand("devices", "List every OpenCL device and whether it can be used");
  add_common_options(*command, *options);
  add_example(*command, "itn devices");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
