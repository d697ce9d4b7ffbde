#include "appearance/training_log.h"

#include <cstdio>
#include <optional>

namespace atelier {
namespace {

/// The step of a whole row, without its end of line.
std::optional<std::int64_t> step_of(const std::string& row) {
  long long step = 0;
  double number = 0;
  int read = 0;
  const bool whole = std::sscanf(row.c_str(), "%lld,%lf,%lf,%lf%n", &step, &number, &number,
                                 &number, &read) == 4 &&
                     static_cast<std::size_t>(read) == row.size();
  return whole ? std::optional<std::int64_t>(step) : std::nullopt;
}

}  // namespace

std::string training_log_header() {
  return "iteration,loss,psnr_db,learning_rate\n";
}

std::string training_log_row(const TrainingStep& step) {
  char text[160];
  std::snprintf(text, sizeof(text), "%lld,%.9g,%.4f,%.6g\n", static_cast<long long>(step.iteration),
                step.loss, step.psnr, step.learning_rate);
  return text;
}

std::string resumed_training_log(std::string_view log, std::int64_t iteration) {
  std::string kept = training_log_header();
  std::int64_t before = 0;
  std::size_t begin = log.find('\n');  // of the header
  while (begin != std::string_view::npos) {
    ++begin;
    const std::size_t end = log.find('\n', begin);
    if (end == std::string_view::npos) {
      break;  // torn, or the end
    }
    const std::string row(log.substr(begin, end - begin));
    const auto step = step_of(row);
    // A row that follows no other begins a log that was named in the middle of a training.
    if (!step || *step < 1 || *step > iteration || (before > 0 && *step != before + 1)) {
      break;
    }
    kept += row + "\n";
    before = *step;
    begin = end;
  }
  return kept;
}

}  // namespace atelier
