#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "capture/detection/network.h"

namespace atelier {

/// Private to capture/detection: a network that OpenCV has read, inside the confined process. Reads
/// an ONNX network and runs it on one image after the other. Throws DataError (`file`) as
/// run_network says.
class LoadedNetwork {
 public:
  LoadedNetwork(std::span<const std::byte> model, std::string file);

  std::vector<NetworkOutput> run(const Image& pixels);

 private:
  struct Layers;  // OpenCV's own
  std::string file_;
  std::shared_ptr<Layers> layers_;
  std::vector<std::string> names_;
};

/// Prepares a process for reading networks, once: no threads, no messages.
void quieten_opencv();

/// The outputs of one image as bytes, and back.
void append_outputs(std::vector<std::byte>& bytes, const std::vector<NetworkOutput>& outputs);

/// Bytes of a number or an array of such, as they lie in memory.
template <class T>
void append_values(std::vector<std::byte>& bytes, std::span<const T> values) {
  const auto raw = std::as_bytes(values);
  bytes.insert(bytes.end(), raw.begin(), raw.end());
}
template <class T>
void append_value(std::vector<std::byte>& bytes, T value) {
  append_values(bytes, std::span<const T>(&value, 1));
}

}  // namespace atelier
