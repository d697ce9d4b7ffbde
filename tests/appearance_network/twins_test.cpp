#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/network/painter.h"
#include "appearance/network/train.h"
#include "core/error.h"
#include "tests/appearance_network/appearance_fixture.h"

namespace atelier {
namespace {

using fixtures::small_data;

/// A model that has learnt a little, so that every part of it gives something.
AppearanceModel learnt_model(const AppearanceData& data) {
  TrainOptions options;
  options.resolution = 32;
  options.channels = 4;
  options.iterations = 20;
  options.learning_rate = 1e-2;
  return train(start_training(data, options), data, options, Device::Cpu).training.model;
}

bool has_gpu(const AppearanceModel& model) {
  try {
    const AppearanceNetwork network(model, Device::Cuda);
    return true;
  } catch (const EnvironmentError&) {
    return false;
  }
}

double norm_of(const Tensor& tensor) {
  double sum = 0;
  for (const float value : values_of<float>(tensor)) {
    sum += static_cast<double>(value) * value;
  }
  return std::sqrt(sum);
}

double distance_of(const Tensor& a, const Tensor& b) {
  const auto x = values_of<float>(a);
  const auto y = values_of<float>(b);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sum += std::pow(static_cast<double>(x[i]) - y[i], 2);
  }
  return std::sqrt(sum);
}

TEST(Twins, LossGradientAndSteps_AgreeOnCpuAndCuda) {
  const AppearanceData data = small_data();
  const AppearanceModel model = learnt_model(data);
  if (!has_gpu(model)) {
    GTEST_SKIP() << "no CUDA device that libtorch could use";
  }
  AppearanceNetwork cpu(model, Device::Cpu);
  AppearanceNetwork cuda(model, Device::Cuda);
  cpu.learn_from(data);
  cuda.learn_from(data);
  const std::vector<int> batch = {1, 4};
  EXPECT_NEAR(cpu.loss(batch).value, cuda.loss(batch).value, 1e-3 * cpu.loss(batch).value);
  // cuDNN may use TF32: three digits.
  const auto one = cpu.loss_gradient(batch);
  const auto other = cuda.loss_gradient(batch);
  for (const auto& [name, tensor] : one) {
    EXPECT_LT(distance_of(tensor, other.at(name)), 0.02 * norm_of(tensor) + 1e-6) << name;
  }
  for (int i = 0; i < 10; ++i) {
    cpu.step({i % 6, (i + 3) % 6}, {.learning_rate = 1e-3});
    cuda.step({i % 6, (i + 3) % 6}, {.learning_rate = 1e-3});
  }
  const std::vector<NetworkLoss> a = cpu.losses();
  const std::vector<NetworkLoss> b = cuda.losses();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i].psnr, b[i].psnr, 0.1) << i;
  }
}

// A GPU repeats a recorded step: views of other sizes, batches of other lengths, other rates and
// constants, and moments that are put in are what it repeats it with.
TEST(Twins, StepsWithChangingBatches_AgreeOnCpuAndCuda) {
  AppearanceData data = small_data();
  const AppearanceModel model = learnt_model(data);
  if (!has_gpu(model)) {
    GTEST_SKIP() << "no CUDA device that libtorch could use";
  }
  for (const std::size_t v : {1U, 2U, 4U}) {
    AppearanceView& view = data.views[v];
    view.pixel.resize(view.pixel.size() / (v + 1));
    view.u.resize(view.pixel.size());
    view.v.resize(view.pixel.size());
    view.colors.resize(3 * view.pixel.size());
  }
  AppearanceNetwork cpu(model, Device::Cpu);
  AppearanceNetwork cuda(model, Device::Cuda);
  cpu.learn_from(data);
  cuda.learn_from(data);
  const auto step = [&](const std::vector<int>& batch, const AdamStep& options) {
    cpu.step(batch, options);
    cuda.step(batch, options);
  };
  for (int i = 0; i < 12; ++i) {
    AdamStep options;
    options.learning_rate = i % 3 == 0 ? 1e-3 : 3e-4;
    options.weight_decay = i < 6 ? 0.01 : 0.3;
    options.beta1 = i < 9 ? 0.9 : 0.8;
    step(i % 4 == 3 ? std::vector<int>{i % 6} : std::vector<int>{i % 6, (i + 1) % 6}, options);
  }
  cuda.resume(cpu.moments(), cpu.steps());
  for (int i = 0; i < 3; ++i) {
    step({i, i + 2, i + 1}, {.learning_rate = 1e-3});
  }
  const std::vector<NetworkLoss> a = cpu.losses();
  const std::vector<NetworkLoss> b = cuda.losses();
  ASSERT_EQ(a.size(), 15U);
  ASSERT_EQ(b.size(), 15U);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i].psnr, b[i].psnr, 0.1) << i;
  }
  EXPECT_EQ(cuda.steps(), 15);
}

TEST(Twins, PaintedImages_AgreeOnCpuAndCuda) {
  const AppearanceData data = small_data();
  const auto model = std::make_shared<const AppearanceModel>(learnt_model(data));
  if (!has_gpu(*model)) {
    GTEST_SKIP() << "no CUDA device that libtorch could use";
  }
  Camera camera;
  camera.id = "above";
  camera.width = camera.height = 48;
  camera.fx = camera.fy = 60;
  camera.cx = camera.cy = 24;
  camera.camera_from_world_rotation << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  camera.camera_from_world_translation = {-0.5, -0.5, 2};
  const Points vertices = data.frames[1].position.cast<double>();
  Painter cpu({{data.faces, model}}, {}, Device::Cpu);
  Painter cuda({{data.faces, model}}, {}, Device::Cuda);
  const Image a = cpu.paint({vertices}, camera);
  const Image b = cuda.paint({vertices}, camera);
  double most = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    most = std::max(most, static_cast<double>(std::abs(a.data[i] - b.data[i])));
  }
  EXPECT_LT(most, 0.01);
}

TEST(Twins, HalfPrecision_LearnsAsWellAsSingle) {
  const AppearanceData data = small_data();
  if (!has_gpu(learnt_model(data))) {
    GTEST_SKIP() << "no CUDA device that libtorch could use";
  }
  TrainOptions options;
  options.resolution = 32;
  options.channels = 4;
  options.iterations = 100;
  options.learning_rate = 1e-2;
  double reached[2] = {0, 0};
  for (const bool half : {false, true}) {
    options.half = half;
    TrainHooks hooks;
    hooks.step = [&](std::int64_t, const NetworkLoss& loss, double) {
      reached[half ? 1 : 0] = loss.psnr;
    };
    EXPECT_TRUE(train(start_training(data, options), data, options, Device::Cuda, hooks).finite);
  }
  EXPECT_GT(reached[1], reached[0] - 1);
}

}  // namespace
}  // namespace atelier
