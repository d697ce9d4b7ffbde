#include "tests/pipeline/toy/toy_stage.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/store/result.h"
#include "core/store/write_text.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

std::vector<double> numbers_of(const fs::path& file) {
  std::istringstream text(read_file_text(file, 1 << 20));
  std::vector<double> numbers;
  for (double number = 0; text >> number;) {
    numbers.push_back(number);
  }
  if (numbers.empty()) {
    throw DataError(file.string(), "", "no number", "at least one");
  }
  return numbers;
}

}  // namespace

OptionTable describe(ToyOptions& options) {
  OptionTable table;
  table.add("low", options.low, -1e6, 1e6, "", "Smallest number that is kept");
  table.add("high", options.high, -1e6, 1e6, "", "Largest number that is kept");
  return table;
}

void run_toy(StageRun& run) {
  const auto& options = run.options<ToyOptions>();
  const std::vector<double> numbers = numbers_of(run.input("numbers"));
  std::vector<int> ids(numbers.size());
  std::iota(ids.begin(), ids.end(), 0);
  const bool complete = run.each_frame("clamped", ".txt", ids, [&](int id, const fs::path& file) {
    const double number = numbers[static_cast<std::size_t>(id)];
    write_text(file, std::to_string(std::clamp(number, options.low, options.high)) + "\n");
  });
  if (!complete) {
    return;
  }
  double sum = 0;
  for (const int id : ids) {
    sum += numbers_of(run.frame_file(id)).front();
  }
  run.output_text("sum.txt", std::to_string(sum) + "\n");
  run.metric("sum", sum);
}

std::vector<Measure> measure_toy(const fs::path& workspace, const fs::path& truth) {
  const fs::path results = results_of_stage(workspace, "toy");
  const auto current = current_name(results);
  if (!current) {
    return {};
  }
  const double sum = numbers_of(results / *current / "sum.txt").front();
  const double wanted = numbers_of(truth / "sum.txt").front();
  return {{"toy.error", std::abs(sum - wanted), "", 0.5, Measure::Side::AtMost, "of the sum"}};
}

std::string toy_pictures(const StageStatus& own, const ReportPlaces& places) {
  const fs::path result = places.workspace / own.stage / folder_name(own.manifest->key);
  return "<p>" + read_file_text(result / "sum.txt", 1 << 10) + "</p>\n";
}

}  // namespace atelier
