#pragma once

#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "appearance/code_losses.h"
#include "appearance/network/layers.h"

namespace atelier {

/// Inputs of a code and its losses for all training frames. Private to appearance/network.
struct CodeFrames {
  torch::Tensor pose;          ///< [F,3J]
  torch::Tensor encoded;       ///< [F,8,s,s]
  torch::Tensor offset;        ///< [F,V,3] m, off the mean surface
  torch::Tensor support;       ///< [F,V,1]
  torch::Tensor begins, ends;  ///< [E] vertices of edges
};

/// Throws DataError for data without the surfaces that the network's geometry learns from.
CodeFrames code_frames(const AppearanceModel& model, const AppearanceData& data,
                       torch::Device device);

/// The layers' masks of the pose and places of vertices in the atlas.
void place_code(Layers& layers, const AppearanceModel& model, torch::Device device);

/// The loss of offsets [B,V,3] in metres of the frames [B], weighted.
torch::Tensor offset_loss(const CodeFrames& code, const CodeLosses& losses,
                          const torch::Tensor& offsets, const torch::Tensor& frames);

}  // namespace atelier
