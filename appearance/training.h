#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "appearance/appearance_model.h"
#include "core/tensor.h"

namespace atelier {

/// A training that can go on: parameters, the optimiser's moments, and how far it is.
struct Training {
  AppearanceModel model;
  std::map<std::string, Tensor> moments;  ///< "m.<parameter>", "v.<parameter>"
  std::int64_t iteration = 0;             ///< steps done
  std::int64_t updates = 0;               ///< of the parameters: fewer where processes take
                                          ///< several steps at once
  std::string options;                    ///< training_text of its options
  std::string data;                       ///< SHA-256 of what it learns from
};

/// As named tensors with texts (a model's and "moment.", schema "atelier.appearance.training"),
/// what checkpoints hold, and back. Reading throws DataError as appearance_model_of does, and
/// unless every parameter of a training that has begun, and nothing else, has both moments, of its
/// shape, the second not below 0.
std::map<std::string, Tensor> tensors_of(const Training& training);
std::map<std::string, std::string> texts_of(const Training& training);
Training training_of(const std::map<std::string, Tensor>& tensors,
                     const std::map<std::string, std::string>& texts, const std::string& file = "");

}  // namespace atelier
