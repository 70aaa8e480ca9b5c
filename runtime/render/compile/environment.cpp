#include "runtime/render/compile/environment.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "runtime/render/compile/environment/fill.h"

namespace itn {

namespace {

// The inverse of the upper left 3x3 of to_world, which must be a rotation or a mirrored one.
void set_rotation(const Environment& environment, EnvironmentRecord& record) {
  const auto& m = environment.to_world.m;
  bool rigid = true;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double product = 0;
      for (std::size_t k = 0; k < 3; ++k) product += m[4 * k + i] * m[4 * k + j];
      rigid = rigid && std::abs(product - (i == j ? 1 : 0)) < 1e-4;
      record.to_local[3 * i + j] = static_cast<float>(m[4 * j + i]);
    }
  require(rigid, environment, "to_world", "a rotation or a mirrored one", "a matrix that scales or shears",
          "light from infinity has no size; remove the scale");
}

}  // namespace

void append_cumulative(const double* weight, std::size_t n, std::vector<float>& tables) {
  constexpr double grid = 0x1p24, least = 4 / grid;
  double total = 0, raised = 0;
  for (std::size_t i = 0; i < n; ++i) total += weight[i];
  const auto share = [&](std::size_t i) {
    if (!(total > 0)) return 1.0;
    return weight[i] > 0 ? std::max(weight[i] / total, least) : 0.0;
  };
  for (std::size_t i = 0; i < n; ++i) raised += share(i);
  double sum = 0;
  tables.push_back(0);
  for (std::size_t i = 0; i < n; ++i) {
    sum += share(i);
    tables.push_back(static_cast<float>(std::min(std::round(sum / raised * grid), grid) / grid));
  }
  tables.back() = 1;
}

int append_sampling(const std::vector<double>& weight, std::size_t rows, std::size_t columns,
                    std::vector<float>& tables) {
  const auto offset = static_cast<int>(tables.size());
  std::vector<double> row_weight(rows);
  for (std::size_t i = 0; i < weight.size(); ++i) row_weight[i / columns] += weight[i];
  append_cumulative(row_weight.data(), rows, tables);
  for (std::size_t i = 0; i < rows; ++i) append_cumulative(weight.data() + i * columns, columns, tables);
  return offset;
}

double sum(const std::vector<double>& values) {
  double total = 0;
  for (const double value : values) total += value;
  return total;
}

void move_radiance(const Parameter& p, EnvironmentRecord& moving) {
  for (int c = 0; c < 3; ++c) moving.radiance[c] = p.component < 0 || p.component == c ? 1.0F : 0.0F;
}

EnvironmentRecord environment_derivative(const Environment& environment, const Parameter& p,
                                         const EnvironmentRecord& record, std::vector<float>& tables) {
  EnvironmentRecord moving = record;
#define ITN_MOVE(name, PREFIX, type) \
  if (environment.model->id == MODEL_##name) name##_move(environment, p, moving, tables);
  ENVIRONMENT_LIST(ITN_MOVE)
  return moving;
}

void append_environment(const Environment& environment, EnvironmentRecord& record, std::vector<float>& tables) {
  record = {};
  record.gradient = -1;
  record.model = environment.model->id;
  set_rotation(environment, record);
#define ITN_FILL(name, PREFIX, type) \
  if (environment.model->id == MODEL_##name) name##_fill(environment, record, tables);
  ENVIRONMENT_LIST(ITN_FILL)
  if (!environment.sampled_as) return;
  if (environment.sampled_as->model != environment.model) throw std::logic_error("light sampled as another model's");
  EnvironmentRecord other;
  append_environment(*environment.sampled_as, other, tables);
  record.sampling = other.sampling;
  record.sun_weight = other.sun_weight;
  record.sky_weight = other.sky_weight;
  record.concentration = other.concentration;
}

bool is_uneven(const EnvironmentRecord& record) {
  const auto& all = environment_models();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Model& m) { return m.id == record.model; });
  return found != all.end() && !(found->traits & ENVIRONMENT_EVEN);
}

std::map<std::string, std::string> environment_definitions(const std::vector<EnvironmentRecord>& records) {
  std::map<std::string, std::string> definitions;
  for (const auto& record : records) {
    if (record.sun_pdf > 0) definitions.emplace("HAS_SUN", "1");
    if (record.complex_sun) definitions.emplace("HAS_COMPLEX_SUN", "1");
  }
  return definitions;
}

}  // namespace itn
