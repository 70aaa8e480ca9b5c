// Training as a library's user meets it; `itn train` is tested in tests/tool.
#include "network/training/training_run.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/network_file.h"
#include "itn/trained_network.h"
#include "tests/support/made_up_dataset.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using Catch::Contains;

namespace {

const std::atomic<bool> never{false};

TrainingRequest request_for(const MadeUpDataset& set, const std::string& folder) {
  TrainingRequest request;
  request.data = {set.folder};
  request.folder = folder;
  request.width = 1;
  request.threads = 1;
  request.epochs = 3;
  request.batch = 8;
  return request;
}

std::vector<double> finish(TrainingRun& run) {
  while (!run.finished()) run.step();
  return run.conclude();
}

}  // namespace

TEST_CASE("a training that is dropped at any step and begun again ends with the same bytes and errors") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 24, 8);
  std::size_t read = 0;
  TrainingRun whole(request_for(set, folder / "whole"), never, [&](std::size_t done, std::size_t all) {
    CHECK(done == ++read);
    CHECK(all == 32);
  });
  CHECK(read == 32);
  const std::vector<double> errors = finish(whole);
  CHECK(whole.fraction() == 1);
  {
    TrainingRun first(request_for(set, folder / "parts"), never);
    for (int i = 0; i < 4; ++i) first.step();
    first.save();
    first.step();  // lost
  }
  TrainingRun second(request_for(set, folder / "parts"), never);
  CHECK(second.trainer().steps() == 4);
  CHECK(finish(second) == errors);
  for (const char* name : {"network.safetensors", "checkpoint.safetensors", "curve.jsonl", "run.json"})
    CHECK(read_file(folder / ("parts/" + std::string(name))) == read_file(folder / ("whole/" + std::string(name))));
  CHECK(network_of(folder / "parts").weights().front().values == second.best().weights().front().values);
}

TEST_CASE("a training stops when it is asked to, and keeps what it has done") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 24, 8);
  std::atomic<bool> cancel{false};
  TrainingRun run(request_for(set, folder / "run"), cancel);
  run.step();
  cancel = true;
  CHECK_THROWS_AS(run.step(), Interrupted);
  CHECK(run.trainer().steps() == 1);
}

TEST_CASE("a training is refused where its folder or its request makes no sense") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 24, 8);
  TrainingRequest request = request_for(set, folder / "run");
  request.lambda = 1;
  CHECK_THROWS_WITH(TrainingRun(request, never), Contains("rn has no image loss"));
  request.lambda.reset();
  { TrainingRun(request, never); }
  request.seed = 3;
  CHECK_THROWS_WITH(TrainingRun(request, never), Contains("holds a training with another seed (0, now 3)"));
  request.threads.reset();  // as many as the folder says
  auto record = nlohmann::ordered_json::parse(read_file(folder / "run/run.json"));
  record.erase("checksum");  // which would be what is refused
  for (const nlohmann::json& threads : std::vector<nlohmann::json>{"two", 0, 1.5, 1000000}) {
    record["request"]["threads"] = threads;
    write_file(folder / "run/run.json", record.dump());
    CHECK_THROWS_WITH(TrainingRun(request, never), Contains("run.json: not a training"));
  }
  request.folder = folder / "foreign";
  std::filesystem::create_directory(request.folder);
  write_network(folder / "foreign/network.safetensors", Network(NetworkDescription()), Precision::single);
  CHECK_THROWS_WITH(TrainingRun(request, never), Contains("holds a network"));
}
