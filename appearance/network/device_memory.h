#pragma once

#include <cstdint>
#include <vector>

#include <torch/torch.h>

#include "core/tensor.h"

namespace atelier {

/// A copy on the device of numbers in this memory. Private to appearance/network.
template <class T>
torch::Tensor on_device(const T* values, const std::vector<std::int64_t>& shape,
                        torch::Device device) {
  const auto type = std::is_same_v<T, float>          ? torch::kFloat32
                    : std::is_same_v<T, std::uint8_t> ? torch::kUInt8
                                                      : torch::kInt64;
  return torch::from_blob(const_cast<T*>(values), shape, torch::TensorOptions().dtype(type))
      .clone()
      .to(device);
}

inline torch::Tensor rows_on_device(const std::vector<std::int64_t>& rows, torch::Device device) {
  return on_device(rows.data(), {static_cast<std::int64_t>(rows.size())}, device);
}

/// The numbers as floats in a tensor of our own.
Tensor off_device(const torch::Tensor& tensor);

/// [1,1,P,2] places in a texture, u and v up in [0,1], as grid_sample wants them.
torch::Tensor sampling_grid(const std::vector<float>& u, const std::vector<float>& v,
                            torch::Device device);

}  // namespace atelier
