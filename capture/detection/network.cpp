#include "capture/detection/network.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>

#include "capture/detection/loaded_network.h"
#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/worker.h"

namespace atelier {
namespace {

constexpr int kMaxDimensions = 6;

/// The first line of what OpenCV says, without its place in OpenCV's sources.
std::string reason_of(const cv::Exception& error) {
  std::string text = error.err.empty() ? error.what() : error.err;
  text = text.substr(0, text.find('\n'));
  constexpr std::size_t kMost = 200;
  return text.substr(0, kMost);
}

int quiet(int /*status*/, const char* /*function*/, const char* /*message*/, const char* /*file*/,
          int /*line*/, void* /*data*/) {
  return 0;
}

/// The child's task.
std::vector<std::byte> outputs_of(std::span<const std::byte> model,
                                  const std::vector<NetworkInput>& inputs,
                                  const std::string& file) {
  quieten_opencv();
  LoadedNetwork network(model, file);
  std::vector<std::byte> bytes;
  for (const NetworkInput& input : inputs) {
    append_outputs(bytes, network.run(input.pixels));
  }
  return bytes;
}

[[noreturn]] void refuse_step(const std::string& file, const std::string& step,
                              const cv::Exception& error) {
  throw DataError(file, "", step + " failed: " + reason_of(error),
                  "an ONNX network that OpenCV " CV_VERSION " runs, and the size of its input");
}

}  // namespace

void quieten_opencv() {
  cv::setNumThreads(1);  // the process may start none
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  cv::redirectError(quiet);
}

struct LoadedNetwork::Layers {
  cv::dnn::Net net;
};

LoadedNetwork::LoadedNetwork(std::span<const std::byte> model, std::string file)
    : file_(std::move(file)), layers_(std::make_shared<Layers>()) {
  cv::dnn::Net& net = layers_->net;
  try {
    net = cv::dnn::readNetFromONNX(reinterpret_cast<const char*>(model.data()), model.size());
    if (net.empty()) {
      throw DataError(file_, "", "a network without layers", "an ONNX network");
    }
    net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    names_ = net.getUnconnectedOutLayersNames();
  } catch (const cv::Exception& error) {
    refuse_step(file_, "reading the network", error);
  }
}

std::vector<NetworkOutput> LoadedNetwork::run(const Image& pixels) {
  std::vector<cv::Mat> outputs;
  try {
    const cv::Mat picture(pixels.height, pixels.width, CV_32FC3,
                          const_cast<float*>(pixels.data.data()));
    layers_->net.setInput(cv::dnn::blobFromImage(picture));
    layers_->net.forward(outputs, names_);
  } catch (const cv::Exception& error) {
    refuse_step(file_,
                "running the network on " + std::to_string(pixels.width) + " x " +
                    std::to_string(pixels.height) + " pixels",
                error);
  }
  std::vector<NetworkOutput> results;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const cv::Mat& output = outputs[i];
    if (output.depth() != CV_32F || output.dims < 2 || output.dims > kMaxDimensions ||
        output.size[0] != 1) {
      throw DataError(
          file_, "output '" + names_[i] + "'", "a shape or type that is not an image's result",
          "float32 [1, ...] of at most " + std::to_string(kMaxDimensions) + " dimensions");
    }
    NetworkOutput result;
    result.name = names_[i];
    for (int d = 1; d < output.dims; ++d) {
      result.shape.push_back(output.size[d]);
    }
    const cv::Mat dense = output.isContinuous() ? output : output.clone();
    result.values.assign(dense.ptr<float>(), dense.ptr<float>() + dense.total());
    results.push_back(std::move(result));
  }
  return results;
}

void append_outputs(std::vector<std::byte>& bytes, const std::vector<NetworkOutput>& outputs) {
  append_value(bytes, static_cast<std::uint32_t>(outputs.size()));
  for (const NetworkOutput& output : outputs) {
    append_value(bytes, static_cast<std::uint32_t>(output.name.size()));
    append_values(bytes, std::span(output.name.data(), output.name.size()));
    append_value(bytes, static_cast<std::uint32_t>(output.shape.size()));
    for (const int side : output.shape) {
      append_value(bytes, static_cast<std::uint32_t>(side));
    }
    append_values(bytes, std::span(output.values.data(), output.values.size()));
  }
}

std::vector<std::vector<NetworkOutput>> run_network(std::span<const std::byte> model,
                                                    const std::vector<NetworkInput>& inputs,
                                                    const std::string& file, const Limits& limits) {
  for (const NetworkInput& input : inputs) {
    ATELIER_CHECK(!input.pixels.data.empty() && input.pixels.channels == 3,
                  "a network's image has pixels of three channels");
  }
  if (model.empty()) {
    throw DataError(file, "", "an empty file", "an ONNX network");
  }
  const std::vector<std::byte> bytes =
      run_in_worker([&] { return outputs_of(model, inputs, file); }, file, limits);
  ByteReader reader(bytes, file);
  std::vector<std::vector<NetworkOutput>> all;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::vector<NetworkOutput> outputs;
    const std::size_t count =
        reader.paid(reader.little<std::uint32_t>("outputs"), 3 * sizeof(std::uint32_t), "outputs");
    for (std::size_t o = 0; o < count; ++o) {
      NetworkOutput output;
      output.name = std::string(reader.text(reader.little<std::uint32_t>("name"), "name"));
      const auto rank = reader.little<std::uint32_t>("rank");
      std::uint64_t total = 1;
      for (std::uint32_t d = 0; d < rank && d < kMaxDimensions; ++d) {
        const auto side = reader.little<std::uint32_t>("side");
        // Every side is paid for at once, so that their product cannot overflow.
        total =
            reader.paid(total * reader.paid(side, sizeof(float), "side"), sizeof(float), "size");
        output.shape.push_back(static_cast<int>(side));
      }
      const auto values = reader.take(static_cast<std::size_t>(total) * sizeof(float), "values");
      output.values.resize(static_cast<std::size_t>(total));
      if (!output.values.empty()) {
        std::memcpy(output.values.data(), values.data(), values.size());
      }
      if (!std::all_of(output.values.begin(), output.values.end(),
                       [](float value) { return std::isfinite(value); })) {
        throw DataError(file, "output '" + output.name + "'", "a number that is not finite",
                        "finite ones; check the mean and deviation of the input");
      }
      outputs.push_back(std::move(output));
    }
    all.push_back(std::move(outputs));
  }
  return all;
}

}  // namespace atelier
