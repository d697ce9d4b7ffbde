#include "appearance/training_log.h"

#include <algorithm>
#include <cstdio>

namespace atelier {
namespace {

/// The step of a whole row, without its end of line.
std::optional<TrainingStep> step_of(const std::string& row) {
  long long iteration = 0;
  TrainingStep step;
  int read = 0;
  const bool whole = std::sscanf(row.c_str(), "%lld,%lf,%lf,%lf%n", &iteration, &step.loss,
                                 &step.psnr, &step.learning_rate, &read) == 4 &&
                     static_cast<std::size_t>(read) == row.size();
  step.iteration = iteration;
  return whole ? std::optional(step) : std::nullopt;
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
    const auto found = step_of(row);
    const std::int64_t step = found ? found->iteration : 0;
    // A row that follows no other begins a log that was named in the middle of a training.
    if (step < 1 || step > iteration || (before > 0 && step != before + 1)) {
      break;
    }
    kept += row + "\n";
    before = step;
    begin = end;
  }
  return kept;
}

std::int64_t judged_after(int iterations, int views, int batch) {
  const int steps_of_all_views = 1 + (views - 1) / batch;
  return iterations - std::max(steps_of_all_views, iterations / 20);
}

std::optional<double> mean_psnr_after(std::string_view log, std::int64_t step) {
  double sum = 0;
  int count = 0;
  std::size_t begin = 0;
  for (std::size_t end = log.find('\n'); end != std::string_view::npos;
       begin = end + 1, end = log.find('\n', begin)) {
    const auto row = step_of(std::string(log.substr(begin, end - begin)));
    if (row && row->iteration > step) {
      sum += row->psnr;
      ++count;
    }
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

}  // namespace atelier
