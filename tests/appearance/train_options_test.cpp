#include "appearance/train_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

TEST(TrainOptions, DefaultPreset_FollowsTheDevice) {
  const TrainOptions asked;
  const TrainOptions on_cpu = resolved(asked, Device::Cpu);
  EXPECT_EQ(on_cpu.setting, TrainSetting::Small);
  EXPECT_EQ(on_cpu.resolution, 256);
  EXPECT_EQ(on_cpu.iterations, 300);
  const TrainOptions on_gpu = resolved(asked, Device::Cuda);
  EXPECT_EQ(on_gpu.setting, TrainSetting::Standard);
  EXPECT_EQ(on_gpu.resolution, 512);
  EXPECT_EQ(on_gpu.iterations, 20'000);
  // Once known it stays, whoever asks again.
  EXPECT_EQ(training_text(on_gpu), training_text(resolved(on_gpu, Device::Cpu)));
  EXPECT_THAT(training_text(on_gpu), ::testing::HasSubstr("standard"));
  for (const TrainSetting setting :
       {TrainSetting::Small, TrainSetting::Standard, TrainSetting::Full}) {
    TrainOptions said;
    said.setting = setting;
    EXPECT_EQ(training_text(resolved(said, Device::Cpu)),
              training_text(resolved(said, Device::Cuda)));
  }
}

TEST(TrainOptions, Presets_HaveTheSizesOfPublishedFigures) {
  struct Sizes {
    TrainSetting setting;
    int resolution, channels, shading, iterations;
    double learning_rate;
  };
  for (const Sizes& sizes : {Sizes{TrainSetting::Small, 256, 8, 2, 300, 1e-3},
                             Sizes{TrainSetting::Standard, 512, 16, 2, 20'000, 5e-4},
                             Sizes{TrainSetting::Full, 1024, 32, 4, 100'000, 1e-4}}) {
    TrainOptions asked;
    asked.setting = sizes.setting;
    const TrainOptions known = resolved(asked);
    EXPECT_EQ(known.resolution, sizes.resolution);
    EXPECT_EQ(known.channels, sizes.channels);
    EXPECT_EQ(known.shading, sizes.shading);
    EXPECT_EQ(known.iterations, sizes.iterations);
    EXPECT_EQ(known.learning_rate, sizes.learning_rate);
    EXPECT_EQ(known.batch, 2);
    EXPECT_EQ(training_problem(known, Device::Cpu), "");
    // Down to 8 texels, where every texel has seen the whole garment.
    const NetworkOptions network = network_options(known);
    EXPECT_EQ(branch_resolution_of(network) >> branch_levels_of(network), 8);
  }
}

TEST(TrainOptions, HalfPrecisionWithoutGpu_IsRefused) {
  TrainOptions asked;
  asked.half = true;
  EXPECT_THAT(training_problem(resolved(asked, Device::Cpu), Device::Cpu),
              ::testing::HasSubstr("works on a GPU alone"));
  EXPECT_EQ(training_problem(resolved(asked, Device::Cuda), Device::Cuda), "");
}

TEST(TrainOptions, ExplicitNumbers_OverrideThePreset) {
  TrainOptions asked;
  asked.channels = 3;
  asked.learning_rate = 0.25;
  for (const Device device : {Device::Cpu, Device::Cuda}) {
    EXPECT_EQ(resolved(asked, device).channels, 3);
    EXPECT_EQ(resolved(asked, device).learning_rate, 0.25);
  }
}

TEST(TrainOptions, ZeroWeightDecay_CanBeSet) {
  TrainOptions asked;
  EXPECT_GT(resolved(asked, Device::Cpu).weight_decay, 0);
  EXPECT_GT(resolved(asked, Device::Cuda).weight_decay, resolved(asked, Device::Cpu).weight_decay);
  asked.weight_decay = 0;
  EXPECT_EQ(resolved(asked, Device::Cuda).weight_decay, 0);
}

/// Another value of a field, in its range.
void change(const OptionField& field) {
  if (auto* const* flag = std::get_if<bool*>(&field.target)) {
    **flag = !**flag;
  } else if (auto* const* number = std::get_if<int*>(&field.target)) {
    **number += 1;
  } else if (auto* const* large = std::get_if<std::int64_t*>(&field.target)) {
    **large += 1;
  } else if (auto* const* real = std::get_if<double*>(&field.target)) {
    **real = (field.min + field.max) / 2;
  } else {
    std::get<OptionEnum>(field.target).set(field.choices.size() - 1);
  }
}

TEST(TrainOptions, EveryKeyedOption_ChangesTheTrainingText) {
  TrainOptions plain;
  const OptionTable table = describe(plain);
  for (std::size_t i = 0; i < table.fields.size(); ++i) {
    TrainOptions other;
    const OptionTable changed = describe(other);
    change(changed.fields[i]);
    ASSERT_NE(option_text(changed.fields[i]), option_text(table.fields[i]));
    EXPECT_EQ(training_text(other) != training_text(plain), table.fields[i].keyed)
        << table.fields[i].name;
  }
}

}  // namespace
}  // namespace atelier
