#include "pipeline/appearance/train_network.h"

#include <chrono>
#include <cstdio>
#include <vector>

#include "appearance/learning_outcome.h"
#include "appearance/training_log.h"
#include "core/io/child_program.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/not_converged.h"

namespace atelier {
namespace {

/// Resolved options of a training as the words of the other program.
std::vector<std::string> words_of(TrainOptions options) {
  std::vector<std::string> words;
  for (const OptionField& field : describe_with_code(options).fields) {
    std::string text = option_text(field);
    if (text.size() >= 2 && text.front() == '"') {
      text = text.substr(1, text.size() - 2);
    }
    words.push_back("--" + field.name);
    words.push_back(text);
  }
  return words;
}

}  // namespace

Trained train_network(StageRun& run, const std::string& name, const TrainOptions& options,
                      int views, const TrainingFiles& files) {
  std::vector<std::string> words = {"train",
                                    files.data.string(),
                                    files.model.string(),
                                    "--log",
                                    files.log.string(),
                                    "--checkpoint",
                                    files.checkpoint.string(),
                                    "--device",
                                    device_name(run.device())};
  const std::vector<std::string> more = words_of(options);
  words.insert(words.end(), more.begin(), more.end());
  Trained result;
  auto start = std::chrono::steady_clock::now();
  long long first = 0;
  const auto train = [&] {
    return run_child_program(
        "atelier-appearance", words, "a build with libtorch (libtorch-dev)",
        [&](const std::string& line) {
          long long step = 0;
          int of = 0;
          double loss = 0;
          double psnr = 0;
          if (std::sscanf(line.c_str(), "begin %lld %d", &step, &of) == 2) {
            start = std::chrono::steady_clock::now();
            first = step;
            run.progress(step, of, "steps");
          } else if (std::sscanf(line.c_str(), "step %lld %d %lf %lf", &step, &of, &loss, &psnr) ==
                     4) {
            result.steps = static_cast<double>(step - first);
            result.seconds =
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            run.progress(step, of, "steps", {{"loss", loss}, {"psnr_db", psnr}});
          }
        },
        [&] { return run.stop_requested(); });
  };
  try {
    result.done = train();
  } catch (const NotConverged& error) {
    throw NotConverged(name + ": " + error.what());
  }
  if (result.done) {
    // From its log, which has all steps: what is resumed takes the last ones alone, or none.
    result.psnr = mean_psnr_after(read_file_text(files.log, Limits{}.text_file_bytes),
                                  judged_after(options.iterations, views, options.batch));
  }
  return result;
}

void require_learnt(StageRun& run, const std::string& name, std::optional<double> psnr,
                    double fixed) {
  if (!psnr) {
    run.warn(name + ": rows of the training log are missing, so its final loss is unknown");
    return;
  }
  const std::string text = name + ": " + poor_outcome_text(*psnr, fixed);
  switch (learning_outcome(*psnr, fixed)) {
    case LearningOutcome::Diverged:
      throw NotConverged(text);
    case LearningOutcome::Doubtful:
      run.warn(text);
      break;
    case LearningOutcome::Sufficient:
      break;
  }
}

}  // namespace atelier
