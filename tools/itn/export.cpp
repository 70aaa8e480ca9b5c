// itn export: a trained network for other tools.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/trained_network.h"
#include "network/model/onnx_file.h"
#include "runtime/base/inputs.h"
#include "tools/itn/common.h"

namespace itn::tools {
namespace {

struct ExportArguments {
  CommonOptions common;
  std::string run, output;
};

void run(const ExportArguments& options) {
  if (std::filesystem::path(options.output).extension() != ".onnx")
    throw UsageError("-o " + options.output + ": need a name that ends in .onnx");
  Inputs read;
  const Network network = network_of(options.run);
  read.end();
  check_outputs(options.common, {options.output});
  const std::string bytes = onnx_bytes(network);
  write_file(options.output, bytes);
  const NetworkDescription& description = network.description();
  nlohmann::ordered_json outputs = nlohmann::ordered_json::array();
  for (const OutputRange& output : description.outputs) outputs.push_back(output.name);
  if (options.common.talkative())
    fmt::print("{}: {} of {} x {} pixels, {} bytes\n", options.output, description.kind, description.size,
               description.size, bytes.size());
  write_json(options.common, {{"schema", "itn.export/1"},
                              {"run", options.run},
                              {"output", options.output},
                              {"network", description.kind},
                              {"size", description.size},
                              {"inputs", onnx_inputs(description)},
                              {"outputs", onnx_outputs(description)},
                              {"parameters", outputs}});
}

}  // namespace

void add_export(CLI::App& app) {
  auto options = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand("export", "Export a trained network as ONNX, for other tools");
  command
      ->add_option("run", options->run,
                   "Folder that itn train wrote, .safetensors file, or network that ships with the program: `shipped`, "
                   "`shipped-photos`")
      ->required();
  command->add_option("-o,--output", options->output, "File to write, NAME.onnx")->required();
  add_common_options(*command, options->common);
  add_example(*command, "itn export shipped-photos -o photos.onnx",
              "Radiance goes in; parameters in their units come out, with their 95 % intervals where the network has "
              "them.");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
