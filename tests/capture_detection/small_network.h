#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace atelier::fixtures {

// Networks small enough to be written by hand: ONNX is protobuf (onnx/onnx.proto), of which a
// handful of fields make a model.

inline std::string varint(std::uint64_t value) {
  std::string bytes;
  while (value >= 0x80) {
    bytes += static_cast<char>(0x80 | (value & 0x7F));
    value >>= 7;
  }
  return bytes + static_cast<char>(value);
}

inline std::string number_field(int field, std::uint64_t value) {
  return varint(static_cast<std::uint64_t>(field) << 3) + varint(value);
}

inline std::string bytes_field(int field, const std::string& bytes) {
  return varint((static_cast<std::uint64_t>(field) << 3) | 2) + varint(bytes.size()) + bytes;
}

inline std::string ints_attribute(const std::string& name,
                                  const std::vector<std::int64_t>& values) {
  std::string text = bytes_field(1, name);
  for (const std::int64_t value : values) {
    text += number_field(8, static_cast<std::uint64_t>(value));
  }
  return bytes_field(5, text + number_field(20, 7));
}

inline std::string tensor(const std::string& name, const std::vector<std::int64_t>& shape,
                          const std::vector<float>& values) {
  std::string text;
  for (const std::int64_t side : shape) {
    text += number_field(1, static_cast<std::uint64_t>(side));
  }
  text += number_field(2, 1);  // float
  text += bytes_field(8, name);
  std::string raw(values.size() * sizeof(float), '\0');
  if (!values.empty()) {
    std::memcpy(raw.data(), values.data(), raw.size());
  }
  return text + bytes_field(9, raw);
}

inline std::string int_tensor(const std::string& name, const std::vector<std::int64_t>& values) {
  std::string raw(values.size() * sizeof(std::int64_t), '\0');
  if (!values.empty()) {
    std::memcpy(raw.data(), values.data(), raw.size());
  }
  return number_field(1, values.size()) + number_field(2, 7) + bytes_field(8, name) +
         bytes_field(9, raw);
}

inline std::string node(const std::string& op, const std::vector<std::string>& inputs,
                        const std::string& output, const std::string& attributes = "") {
  std::string text;
  for (const std::string& input : inputs) {
    text += bytes_field(1, input);
  }
  return text + bytes_field(2, output) + bytes_field(3, op + "_" + output) + bytes_field(4, op) +
         attributes;
}

inline std::string value_info(const std::string& name, const std::vector<std::int64_t>& shape) {
  std::string dims;
  for (const std::int64_t side : shape) {
    dims += bytes_field(1, number_field(1, static_cast<std::uint64_t>(side)));
  }
  return bytes_field(1, name) +
         bytes_field(2, bytes_field(1, number_field(1, 1) + bytes_field(2, dims)));
}

struct SmallNetwork {
  std::vector<std::string> nodes;
  std::vector<std::string> initializers;
  std::vector<std::int64_t> input;
  std::vector<std::pair<std::string, std::vector<std::int64_t>>> outputs;
};

inline std::vector<std::byte> onnx_bytes(const SmallNetwork& network) {
  std::string graph;
  for (const std::string& one : network.nodes) {
    graph += bytes_field(1, one);
  }
  graph += bytes_field(2, "small");
  for (const std::string& one : network.initializers) {
    graph += bytes_field(5, one);
  }
  graph += bytes_field(11, value_info("input", network.input));
  for (const auto& [name, shape] : network.outputs) {
    graph += bytes_field(12, value_info(name, shape));
  }
  const std::string model = number_field(1, 7) + bytes_field(7, graph) +
                            bytes_field(8, bytes_field(1, "") + number_field(2, 11));
  std::vector<std::byte> bytes(model.size());
  std::memcpy(bytes.data(), model.data(), model.size());
  return bytes;
}

/// A 1x1 convolution: output channel k is the sum of weights[k][c] times input channel c.
inline SmallNetwork mixing_network(const std::vector<std::vector<float>>& weights, int width,
                                   int height) {
  std::vector<float> flat;
  for (const auto& row : weights) {
    flat.insert(flat.end(), row.begin(), row.end());
  }
  const auto count = static_cast<std::int64_t>(weights.size());
  SmallNetwork network;
  network.input = {1, 3, height, width};
  network.initializers = {tensor("w", {count, 3, 1, 1}, flat)};
  network.nodes = {node("Conv", {"input", "w"}, "maps", ints_attribute("kernel_shape", {1, 1}))};
  network.outputs = {{"maps", {1, count, height, width}}};
  return network;
}

/// SimCC of the same maps: the largest of each column for x, of each row for y.
inline SmallNetwork simcc_network(const std::vector<std::vector<float>>& weights, int width,
                                  int height) {
  SmallNetwork network = mixing_network(weights, width, height);
  const auto count = static_cast<std::int64_t>(weights.size());
  network.initializers.push_back(int_tensor("shape_x", {1, count, width}));
  network.initializers.push_back(int_tensor("shape_y", {1, count, height}));
  network.nodes.push_back(
      node("MaxPool", {"maps"}, "columns",
           ints_attribute("kernel_shape", {height, 1}) + ints_attribute("strides", {height, 1})));
  network.nodes.push_back(
      node("MaxPool", {"maps"}, "rows",
           ints_attribute("kernel_shape", {1, width}) + ints_attribute("strides", {1, width})));
  network.nodes.push_back(node("Reshape", {"columns", "shape_x"}, "simcc_x"));
  network.nodes.push_back(node("Reshape", {"rows", "shape_y"}, "simcc_y"));
  network.outputs = {{"simcc_x", {1, count, width}}, {"simcc_y", {1, count, height}}};
  return network;
}

}  // namespace atelier::fixtures
