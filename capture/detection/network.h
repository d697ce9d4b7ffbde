#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/limits.h"

namespace atelier {

/// One output of a network for one image: the first dimension (the batch, 1) is left out.
struct NetworkOutput {
  std::string name;
  std::vector<int> shape;     ///< [K,h,w], [K,n], ...
  std::vector<float> values;  ///< row-major
};

/// Inputs of a network.
struct NetworkInput {
  Image pixels;  ///< [H,W,3], as the network wants them: normalised, in its order of channels
};

/// Runs a user's ONNX network over images, one at a time, by OpenCV's DNN. Model and run are
/// confined: a process of its own that can open no file, write nothing, start nothing
/// (core/io/worker.h), with `limits.worker_memory_bytes` and `limits.worker_cpu_seconds` for all
/// images together. The result has one list of outputs for each image, in the network's order.
///
/// Throws DataError (`file`) for what is no ONNX, operators that OpenCV does not know, inputs of
/// another shape, outputs that are no floating-point numbers or not finite, a process that dies or
/// takes too long; LogicError for images without pixels or of other than three channels.
std::vector<std::vector<NetworkOutput>> run_network(std::span<const std::byte> model,
                                                    const std::vector<NetworkInput>& inputs,
                                                    const std::string& file,
                                                    const Limits& limits = {});

}  // namespace atelier
