#include "appearance/training.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include "appearance/content_digest.h"
#include "core/error.h"
#include "core/options.h"

namespace atelier {
namespace {

constexpr const char* kTrainingSchema = "atelier.appearance.training";
constexpr const char* kMoment = "moment.";

/// @param name  "m.<parameter>", the mean of its slope, or "v.<parameter>", that of its square
void check_moment(const std::string& name, const Tensor& moment, const AppearanceModel& model,
                  const std::string& file) {
  const std::string where = std::string("tensor ") + kMoment + name;
  const bool squared = name.starts_with("v.");
  const auto parameter = squared || name.starts_with("m.") ? model.parameters.find(name.substr(2))
                                                           : model.parameters.end();
  if (parameter == model.parameters.end()) {
    throw DataError(file, where, "of nothing that is learnt", "m. or v. with a parameter's name");
  }
  if (moment.type != ElementType::Float32 || moment.shape != parameter->second.shape) {
    throw DataError(file, where,
                    std::string(element_type_name(moment.type)) + " " + shape_text(moment.shape),
                    "float32 " + shape_text(parameter->second.shape));
  }
  check_finite(moment, file, where);
  const auto values = values_of<float>(moment);
  if (squared && std::any_of(values.begin(), values.end(), [](float v) { return v < 0; })) {
    throw DataError(file, where, "a number below 0", "a mean of squares");
  }
}

}  // namespace

std::map<std::string, Tensor> tensors_of(const Training& training) {
  std::map<std::string, Tensor> tensors = tensors_of(training.model);
  for (const auto& [name, moment] : training.moments) {
    tensors[kMoment + name] = moment;
  }
  return tensors;
}

std::map<std::string, std::string> texts_of(const Training& training) {
  std::map<std::string, std::string> texts = texts_of(training.model);
  texts["training"] = kTrainingSchema;
  texts["iteration"] = std::to_string(training.iteration);
  if (training.updates != training.iteration) {
    texts["updates"] = std::to_string(training.updates);
  }
  texts["options"] = training.options;
  texts["data"] = training.data;
  texts[kDigestText] = content_digest(tensors_of(training), texts);  // of the moments, too
  return texts;
}

Training training_of(const std::map<std::string, Tensor>& tensors,
                     const std::map<std::string, std::string>& texts, const std::string& file) {
  const auto text = [&](const char* name) -> const std::string& {
    const auto found = texts.find(name);
    if (found == texts.end()) {
      throw DataError(file, name, "nothing", "a checkpoint of a training");
    }
    return found->second;
  };
  if (text("training") != kTrainingSchema) {
    throw DataError(file, "training", text("training").substr(0, 60), kTrainingSchema);
  }
  Training training;
  std::map<std::string, Tensor> of_model;
  const std::string_view prefix = kMoment;
  for (const auto& [name, tensor] : tensors) {
    if (name.starts_with(prefix)) {
      training.moments[name.substr(prefix.size())] = tensor;
    } else {
      of_model[name] = tensor;
    }
  }
  std::map<std::string, std::string> texts_of_model = texts;
  texts_of_model.erase(kDigestText);  // which is of the moments, too
  training.model = appearance_model_of(of_model, texts_of_model, file);
  const auto count = [&](const char* name, int most) {
    int steps = 0;
    OptionTable number;
    number.add(name, steps, 0, most, "", "Number of training steps done");
    if (const std::string wrong = set_option(number, name, text(name)); !wrong.empty()) {
      throw DataError(file, name, wrong, "a number of steps");
    }
    return steps;
  };
  const int iteration = count("iteration", std::numeric_limits<int>::max());
  training.iteration = iteration;
  training.updates = texts.contains("updates") ? count("updates", iteration) : iteration;
  training.options = text("options");
  training.data = text("data");
  const std::size_t moments = iteration > 0 ? 2 * training.model.parameters.size() : 0;
  if (training.moments.size() != moments) {
    throw DataError(file, kMoment, std::to_string(training.moments.size()) + " moments",
                    std::to_string(moments) + " after so many steps");
  }
  for (const auto& [name, moment] : training.moments) {
    check_moment(name, moment, training.model, file);
  }
  require_digest(tensors, texts, file, "take another checkpoint");
  return training;
}

}  // namespace atelier
