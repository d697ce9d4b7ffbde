#include "appearance/network/network.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/mean_texture.h"
#include "appearance/network/train.h"
#include "core/archive.h"
#include "core/error.h"
#include "tests/appearance_network/appearance_fixture.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using fixtures::learner;
using fixtures::nudge;
using fixtures::small_data;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TrainOptions small_options(int iterations = 8) {
  TrainOptions options;
  options.resolution = 16;
  options.channels = 2;
  options.iterations = iterations;
  options.learning_rate = 1e-2;
  options.checkpoint_every = 4;
  return options;
}

/// What it gives at the pixels of a view of the data.
std::vector<float> colors_of(const AppearanceNetwork& network, const AppearanceData& data,
                             std::size_t view) {
  const AppearanceView& of = data.views[view];
  return network.colors(data.frames[static_cast<std::size_t>(of.frame_idx)],
                        data.centers.row(of.camera_idx), {of.u, of.v, {}});
}

Image texture_of_view(const AppearanceNetwork& network, const AppearanceData& data,
                      std::size_t view) {
  const AppearanceView& of = data.views[view];
  return network.texture(data.frames[static_cast<std::size_t>(of.frame_idx)],
                         data.centers.row(of.camera_idx));
}

/// Last convolutions begin at 0, where nothing before them matters: as if they had learnt
/// something.
void awaken(AppearanceModel& model) {
  for (const char* last : {"independent.last.g", "dependent.last.g", "shadow.last.g"}) {
    for (std::size_t i = 0; i < model.parameters.at(last).data.size() / 4; ++i) {
      nudge(model, last, i, 0.1F);
    }
  }
}

TEST(Network, MeanTexture_DarkensWithOcclusionAsItSays) {
  AppearanceData data = small_data();
  for (SurfaceFrame& frame : data.frames) {
    frame.transfer.setConstant(0.9F);
  }
  const AppearanceModel model = mean_texture_model(data, 16, {.max_angle = 90, .darkening = 6});
  const AppearanceNetwork network(model, Device::Cpu);
  const Eigen::Vector3d above(0.5, 3, 0.5);
  const Image open = network.texture(data.frames[0], above);
  for (std::size_t i = 0; i < open.data.size(); i += 31) {
    EXPECT_NEAR(open.data[i], model.static_texture.data[i], 1e-5F);
  }
  SurfaceFrame dark = data.frames[0];
  dark.transfer.setConstant(0.4F);
  const Image shaded = network.texture(dark, above);
  const double share = (1 + std::exp(-3.0)) / (1 + std::exp(-(3.0 + 6 * (0.4 - 0.9))));
  const std::size_t middle = 3 * (8 * 16 + 8);
  EXPECT_NEAR(shaded.data[middle] / open.data[middle], share, 1e-4);
}

TEST(Network, InitialNetwork_ReproducesTheStaticTexture) {
  const AppearanceData data = small_data();
  const AppearanceModel model = initial_model(data, network_options(small_options()), 1);
  const std::vector<float> drawn = colors_of(AppearanceNetwork(model, Device::Cpu), data, 1);
  const std::vector<float> fixed =
      sample_texture(model.static_texture, {data.views[1].u, data.views[1].v, {}});
  double squares = 0;
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    const double difference = drawn[i] - fixed[i];
    squares += difference * difference;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(fixed.size())), 1e-4);
}

TEST(Network, Textures_HaveFrom16To2048Texels) {
  const AppearanceData data = small_data();
  for (const int resolution : {16, 256, 2048}) {
    TrainOptions options = small_options();
    options.resolution = resolution;
    options.shading = resolution > 1024 ? 16 : 1;
    const AppearanceModel model = initial_model(data, network_options(options), 1);
    const Image texture = texture_of_view(AppearanceNetwork(model, Device::Cpu), data, 1);
    ASSERT_EQ(texture.width, resolution);
    ASSERT_EQ(texture.height, resolution);
    EXPECT_TRUE(std::all_of(texture.data.begin(), texture.data.end(),
                            [](float value) { return std::isfinite(value); }));
  }
}

TEST(Network, MeanTextureAlone_IsSampledAsRasterized) {
  const AppearanceData data = small_data();
  TrainOptions options = small_options();
  options.view_independent = options.view_dependent = options.shadow = false;
  const AppearanceModel model = initial_model(data, network_options(options), 1);
  EXPECT_EQ(model.parameters.size(), 2U);
  const AppearanceNetwork network(model, Device::Cpu);
  TexturePixels places;
  for (int i = 0; i < 50; ++i) {
    places.u.push_back(0.1F + 0.015F * static_cast<float>(i));
    places.v.push_back(0.9F - 0.014F * static_cast<float>(i));
  }
  const std::vector<float> drawn = network.colors(data.frames[0], data.centers.row(0), places);
  const std::vector<float> sampled = sample_texture(texture_of_view(network, data, 0), places);
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    EXPECT_NEAR(drawn[i], sampled[i], 1e-5F);
  }
}

/// With branches as fine as the texture, and half as fine.
class NetworkGradients : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Resolutions, NetworkGradients, ::testing::Values(16, 32));

TEST_P(NetworkGradients, Gradients_MatchFiniteDifferences) {
  const AppearanceData data = small_data();
  TrainOptions options = small_options();
  options.resolution = GetParam();
  ASSERT_EQ(branch_resolution_of(network_options(options)), 16);
  AppearanceModel model = initial_model(data, network_options(options), 3);
  awaken(model);
  fixtures::expect_gradients(model, data, {0, 3});
}

TEST(Network, TexelsBetweenCharts_CopyTheSeam) {
  const AppearanceData data = small_data();
  const AppearanceModel model = initial_model(data, network_options(small_options()), 1);
  const Image texture = texture_of_view(AppearanceNetwork(model, Device::Cpu), data, 0);
  const TexelMap texels = texel_map(data.faces, data.uvs, data.uv_faces, 16);
  int beside = 0;
  for (std::size_t i = 0; i < texels.source.size(); ++i) {
    const auto from = static_cast<std::size_t>(texels.source[i]);
    beside += from != i ? 1 : 0;
    EXPECT_EQ(texture.data[3 * i], texture.data[3 * from]);
  }
  EXPECT_GT(beside, 10);
}

TEST(Network, EachSwitch_RemovesItsBranch) {
  const AppearanceData data = small_data();
  TrainOptions options = small_options();
  options.shadow = false;
  EXPECT_FALSE(
      initial_model(data, network_options(options), 1).parameters.contains("shadow.first.v"));
  options = small_options();
  options.transfer_degree = 0;
  EXPECT_EQ(initial_model(data, network_options(options), 1).parameters.at("shadow.first.v").shape,
            (std::vector<std::int64_t>{2, 1, 3, 3}));
  options.transfer_degree = 1;
  EXPECT_EQ(initial_model(data, network_options(options), 1).parameters.at("shadow.first.v").shape,
            (std::vector<std::int64_t>{2, 4, 3, 3}));
  options = small_options();
  options.view_dependent = false;
  const AppearanceModel model = initial_model(data, network_options(options), 1);
  const AppearanceNetwork network(model, Device::Cpu);
  // The same frame from two cameras.
  EXPECT_EQ(texture_of_view(network, data, 0).data, texture_of_view(network, data, 1).data);
  options.view_dependent = true;
  options.pixel_bias = true;
  AppearanceModel per_texel = initial_model(data, network_options(options), 1);
  EXPECT_EQ(per_texel.parameters.at("independent.first.b").shape,
            (std::vector<std::int64_t>{2, 16, 16}));
  awaken(per_texel);
  const AppearanceNetwork other(per_texel, Device::Cpu);
  EXPECT_NE(texture_of_view(other, data, 0).data, texture_of_view(other, data, 1).data);
}

TEST(Train, OptimizerSteps_MatchAdamW) {
  // Against the formulas (Loshchilov and Hutter 2019, algorithm 2), in double precision.
  const AppearanceData data = small_data();
  AppearanceModel model = initial_model(data, network_options(small_options()), 2);
  awaken(model);
  AppearanceNetwork network = learner(model, data);
  AdamStep by;
  by.learning_rate = 0.02;
  by.weight_decay = 0.5;
  std::map<std::string, std::vector<double>> first;
  std::map<std::string, std::vector<double>> second;
  for (int t = 1; t <= 3; ++t) {
    const std::vector<int> batch = {t, 5 - t};
    const auto before = network.parameters();
    const auto gradient = network.loss_gradient(batch);
    network.step(batch, by);
    const auto after = network.parameters();
    ASSERT_EQ(network.steps(), t);
    for (const auto& [name, tensor] : before) {
      const auto values = values_of<float>(tensor);
      const auto slopes = values_of<float>(gradient.at(name));
      const auto stepped = values_of<float>(after.at(name));
      std::vector<double>& m = first[name];
      std::vector<double>& v = second[name];
      m.resize(values.size());
      v.resize(values.size());
      // A mean texture is not to fade, nor a gain.
      const bool fixed = name == "texture.mean" || name == "gain.log";
      for (std::size_t i = 0; i < values.size(); ++i) {
        m[i] = by.beta1 * m[i] + (1 - by.beta1) * slopes[i];
        v[i] = by.beta2 * v[i] + (1 - by.beta2) * slopes[i] * slopes[i];
        const double mean = m[i] / (1 - std::pow(by.beta1, t));
        const double spread = v[i] / (1 - std::pow(by.beta2, t));
        const double decayed = values[i] * (1 - (fixed ? 0 : by.learning_rate * by.weight_decay));
        const double expected =
            decayed - by.learning_rate * mean / (std::sqrt(spread) + by.epsilon);
        // Of a slope that is next to nothing the rounding decides which way the step goes.
        EXPECT_NEAR(stepped[i], expected,
                    std::abs(slopes[i]) > 1e-6 ? 2e-5 : 2.1 * by.learning_rate)
            << name << " " << i << " after " << t;
      }
    }
  }
}

TEST(Train, TrainedNetwork_BeatsTheStaticTexture) {
  const AppearanceData data = small_data();
  TrainOptions options = small_options(150);
  options.channels = 4;
  const Training start = start_training(data, options);
  const std::vector<int> all = {0, 1, 2, 3, 4, 5};
  TrainOptions fixed = options;
  fixed.view_independent = fixed.view_dependent = fixed.shadow = false;
  const double before = learner(start_training(data, fixed).model, data).loss(all).psnr;
  const TrainResult result = train(start, data, options, Device::Cpu);
  EXPECT_TRUE(result.finite);
  EXPECT_EQ(result.training.iteration, 150);
  EXPECT_GT(learner(result.training.model, data).loss(all).psnr, before + 2);
}

TEST(Train, TransferDependentShadow_IsLearned) {
  // As much of the sky is hidden everywhere and always, but not the same part of it, and where
  // light does not come from x it is dark.
  AppearanceData data = small_data();
  const TexelMap texels = texel_map(data.faces, data.uvs, data.uv_faces, 16);
  for (SurfaceFrame& frame : data.frames) {
    frame.transfer.setConstant(0.5F);
    frame.transfer.col(3) =
        0.5F *
        (4 * frame.position.col(0).array() + 2.0F * static_cast<float>(frame.frame_id)).sin();
  }
  for (AppearanceView& view : data.views) {
    const SurfaceFrame& frame = data.frames[static_cast<std::size_t>(view.frame_idx)];
    const Eigen::MatrixXf from_x = texel_values(texels, data.faces, frame.transfer.col(3));
    for (std::size_t i = 0; i < view.colors.size(); ++i) {
      const float light = 0.5F + 0.8F * from_x(static_cast<Index>(i / 3), 0);
      view.colors[i] = static_cast<std::uint8_t>(std::lround(200 * light));
    }
  }
  double psnr[2] = {0, 0};
  for (const int degree : {0, 1}) {
    TrainOptions options = small_options(150);
    options.channels = 4;
    options.transfer_degree = degree;
    const TrainResult result = train(start_training(data, options), data, options, Device::Cpu);
    psnr[degree] = learner(result.training.model, data).loss({0, 1, 2, 3, 4, 5}).psnr;
  }
  EXPECT_GT(psnr[1], psnr[0] + 3);
}

TEST(Train, ResumedTraining_IsBitIdentical) {
  const AppearanceData data = small_data();
  const TrainOptions options = small_options(12);
  const TrainResult whole = train(start_training(data, options), data, options, Device::Cpu);
  std::int64_t seen = 0;
  TrainHooks hooks;
  hooks.step = [&](std::int64_t iteration, const NetworkLoss&, double) { seen = iteration; };
  hooks.stop = [&] { return seen == 7; };
  const TrainResult half = train(start_training(data, options), data, options, Device::Cpu, hooks);
  EXPECT_TRUE(half.stopped);
  EXPECT_EQ(half.training.iteration, 7);
  const Training read = training_of(tensors_of(half.training), texts_of(half.training));
  require_same_training(read, data, options);
  const TrainResult rest = train(read, data, options, Device::Cpu);
  for (const auto& [name, tensor] : whole.training.model.parameters) {
    EXPECT_EQ(rest.training.model.parameters.at(name).data, tensor.data) << name;
  }
}

TEST(Train, SlowCheckpoints_AreSavedLessOften) {
  const AppearanceData data = small_data();
  using Clock = std::chrono::steady_clock;
  const auto saves = [&](int every) {
    TrainOptions options = small_options(300);
    options.checkpoint_every = every;
    std::vector<std::int64_t> when;
    const auto begin = Clock::now();
    TrainHooks hooks;
    hooks.checkpoint = [&](const Training& training) {
      when.push_back(training.iteration);
      // As long as the hundred steps before: a twentieth of the time is past the end.
      for (const auto now = Clock::now(); Clock::now() - now < now - begin;) {
      }
    };
    train(start_training(data, options), data, options, Device::Cpu, hooks);
    return when;
  };
  EXPECT_THAT(saves(0), ElementsAre(100));
  EXPECT_THAT(saves(100), ElementsAre(100, 200, 300));
}

TEST(Train, NonFiniteLoss_KeepsTheLastCheckpoint) {
  const AppearanceData data = small_data();
  TrainOptions options = small_options(20);
  options.checkpoint_every = 5;
  Training good;
  TrainHooks hooks;
  hooks.checkpoint = [&](const Training& training) { good = training; };
  std::int64_t seen = 0;
  hooks.step = [&](std::int64_t iteration, const NetworkLoss&, double) { seen = iteration; };
  hooks.stop = [&] { return seen == 5; };
  EXPECT_TRUE(train(start_training(data, options), data, options, Device::Cpu, hooks).stopped);
  ASSERT_EQ(good.iteration, 5);
  // A moment that the next step cannot survive.
  Tensor& moment = good.moments.at("m.texture.mean");
  moment = tensor_of(std::vector<float>(static_cast<std::size_t>(element_count(moment)), 3e38F),
                     moment.shape);
  const Training before = good;
  hooks.stop = nullptr;
  const TrainResult broken = train(before, data, options, Device::Cpu, hooks);
  EXPECT_FALSE(broken.finite);
  EXPECT_FALSE(broken.stopped);
  for (const Training* kept : std::initializer_list<const Training*>{&good, &broken.training}) {
    EXPECT_EQ(kept->iteration, 5);
    for (const auto& [name, tensor] : before.model.parameters) {
      EXPECT_EQ(kept->model.parameters.at(name).data, tensor.data) << name;
    }
  }
}

TEST(TrainRefused, ResumeWithOtherData_IsRefused) {
  const AppearanceData data = small_data();
  const TrainOptions options = small_options();
  const Training training = start_training(data, options);
  EXPECT_NO_THROW(require_same_training(training, data, options));
  const std::vector<std::pair<const char*, std::function<void(AppearanceData&)>>> changes = {
      {"name", [](auto& d) { d.name = "skirt"; }},
      {"faces", [](auto& d) { d.faces.row(0).reverseInPlace(); }},
      {"uvs", [](auto& d) { d.uvs(3, 0) += 1e-3; }},
      {"uv_faces", [](auto& d) { d.uv_faces.row(0).reverseInPlace(); }},
      {"camera_ids", [](auto& d) { std::swap(d.camera_ids[0], d.camera_ids[1]); }},
      {"centers", [](auto& d) { d.centers(1, 2) += 0.01; }},
      {"widths", [](auto& d) { d.widths[0] += 1; }},
      {"heights", [](auto& d) { d.heights[1] += 1; }},
      {"frame_id", [](auto& d) { d.frames[1].frame_id = 7; }},
      {"position", [](auto& d) { d.frames[1].position(5, 1) += 0.01F; }},
      {"transfer", [](auto& d) { d.frames[2].transfer(5, 11) = 0.25F; }},
      {"camera_idx", [](auto& d) { std::swap(d.views[0].camera_idx, d.views[1].camera_idx); }},
      {"frame_idx", [](auto& d) { std::swap(d.views[0].frame_idx, d.views[2].frame_idx); }},
      {"pixel", [](auto& d) { std::swap(d.views[0].pixel[0], d.views[0].pixel[1]); }},
      {"u", [](auto& d) { d.views[0].u[3] += 0.01F; }},
      {"v", [](auto& d) { d.views[0].v[3] -= 0.01F; }},
      {"colors", [](auto& d) { d.views[0].colors[0] ^= 1; }},
  };
  for (const auto& [what, change] : changes) {
    AppearanceData other = data;
    change(other);
    SCOPED_TRACE(what);
    ATELIER_EXPECT_REFUSED(require_same_training(training, other, options), DataError,
                           "other data");
  }
}

TEST(TrainRefused, CheckpointWithFlippedBit_IsRefused) {
  const AppearanceData data = small_data();
  const TrainOptions options = small_options(2);
  const Training training =
      train(start_training(data, options), data, options, Device::Cpu).training;
  const auto texts = texts_of(training);
  const auto tensors = tensors_of(training);
  EXPECT_EQ(training_of(tensors, texts).iteration, 2);
  for (const auto& [name, tensor] : tensors) {
    auto damaged = tensors;
    // The lowest bit of a number: no range and no shape tells.
    damaged.at(name).data[damaged.at(name).data.size() / 2 / 8 * 8] ^= std::byte{1};
    SCOPED_TRACE(name);
    EXPECT_THROW(training_of(damaged, texts), DataError);
  }
  // As an older program wrote it.
  auto older = texts;
  older.erase("digest");
  EXPECT_EQ(training_of(tensors, older).iteration, 2);
  older = texts_of(training.model);
  older.erase("digest");
  EXPECT_EQ(appearance_model_of(tensors_of(training.model), older).name, training.model.name);
  // A network of its own is told by its own digest.
  auto of_model = tensors_of(training.model);
  of_model.at("texture.mean").data[0] ^= std::byte{1};
  ATELIER_EXPECT_REFUSED(appearance_model_of(of_model, texts_of(training.model), "x.safetensors"),
                         DataError, "damaged");
}

TEST(AppearanceData, Archive_RoundTrips) {
  const AppearanceData data = small_data();
  const AppearanceData back = appearance_data_of(archive_of(data));
  EXPECT_EQ(back.name, data.name);
  EXPECT_EQ(back.camera_ids, data.camera_ids);
  ASSERT_EQ(back.views.size(), data.views.size());
  EXPECT_EQ(back.views[4].colors, data.views[4].colors);
  EXPECT_EQ(back.views[4].pixel, data.views[4].pixel);
  EXPECT_NEAR(back.views[4].u[7], data.views[4].u[7], 1e-5);
  EXPECT_LT((back.frames[2].tangent - data.frames[2].tangent).cwiseAbs().maxCoeff(), 1e-5F);
  EXPECT_EQ(back.frames[2].position, data.frames[2].position);
  EXPECT_EQ(back.frames[2].transfer, data.frames[2].transfer);
  EXPECT_FALSE(back.occlusion.has_value());  // as a file of an older program
}

TEST(AppearanceData, OcclusionOptions_AreKeptInNetworkAndFile) {
  AppearanceData data = small_data();
  data.occlusion = OcclusionOptions{3, 0.25, 0.001};
  const AppearanceData back = appearance_data_of(archive_of(data));
  ASSERT_TRUE(back.occlusion.has_value());
  const Training training = start_training(back, small_options());
  const Training again = training_of(tensors_of(training), texts_of(training));
  const AppearanceModel model =
      appearance_model_of(tensors_of(again.model), texts_of(again.model), "x");
  ASSERT_TRUE(model.occlusion.has_value());
  EXPECT_EQ(model.occlusion->strata, 3);
  EXPECT_EQ(model.occlusion->reach, 0.25);
  EXPECT_EQ(model.occlusion->offset, 0.001);
  // One of an older program, which does not say it, is taken.
  const AppearanceModel old = initial_model(small_data(), network_options(small_options()), 1);
  EXPECT_FALSE(appearance_model_of(tensors_of(old), texts_of(old)).occlusion.has_value());
}

TEST(AppearanceDataRefused, InconsistentArrays_AreRefused) {
  const AppearanceData data = small_data();
  const Archive good = archive_of(data);
  const auto refused = [&](const std::function<void(Archive&)>& damage, const char* words) {
    Archive archive = good;
    damage(archive);
    ATELIER_EXPECT_REFUSED(appearance_data_of(archive, "x.h5"), DataError, words);
  };
  refused(
      [](Archive& a) {
        a.datasets["frames/id"] = tensor_of(std::vector<int>{1, 2});
      },
      "frames/position");
  refused(
      [](Archive& a) {
        a.datasets["frames/transfer"] =
            tensor_of(std::vector<float>(3 * 49 * 18, 2.0F), {3, 49, 2, 9});
      },
      "2 of degree 0");
  refused([](Archive& a) { a.version = 1; }, "run it again");
  refused([](Archive& a) { a.datasets.erase("atlas/uv_faces"); }, "texture faces");
  refused([](Archive& a) { a.datasets.erase("frames/position"); }, "frames/position");
  refused([](Archive& a) { a.datasets["views/camera"] = tensor_of(std::vector<int>(6, 2)); },
          "views/camera");
  refused(
      [](Archive& a) { a.datasets["views/begin"] = tensor_of(std::vector<std::int64_t>(7, 5)); },
      "views");
  refused(
      [](Archive& a) { a.datasets["pixels/uv"].shape = {element_count(a.datasets["pixels/uv"])}; },
      "pixels/uv");
  refused(
      [](Archive& a) {
        std::vector<int> far(static_cast<std::size_t>(element_count(a.datasets["pixels/uv"]) / 2),
                             64 * 64);
        a.datasets["pixels/place"] = tensor_of(far);
      },
      "outside of the image");
}

TEST(AppearanceModelRefused, ModelOfOtherArchitecture_IsRefused) {
  const AppearanceData data = small_data();
  const TrainOptions options = small_options();
  const Training training = start_training(data, options);
  const auto tensors = tensors_of(training.model);
  const auto texts = texts_of(training.model);
  const AppearanceModel back = appearance_model_of(tensors, texts);
  EXPECT_EQ(back.static_gain, training.model.static_gain);
  EXPECT_EQ(back.static_texture.data, training.model.static_texture.data);
  const auto refused = [&](const auto& damage, const char* words) {
    auto some_tensors = tensors;
    auto some_texts = texts;
    damage(some_tensors, some_texts);
    ATELIER_EXPECT_REFUSED(appearance_model_of(some_tensors, some_texts, "x"), DataError, words);
  };
  refused([](auto&, auto& t) { t.erase("schema"); }, "schema");
  refused([](auto&, auto& t) { t["version"] = "9"; }, "version");
  refused([](auto&, auto& t) { t["network.channels"] = "many"; }, "channels");
  refused([](auto&, auto& t) { t["network.channels"] = "4"; }, "tensor ");
  refused([](auto&, auto& t) { t["network.resolution"] = "17"; }, "power of 2");
  refused([](auto&, auto& t) { t["network.shading"] = "3"; }, "power of 2");
  refused([](auto&, auto& t) { t["occlusion.strata"] = "8"; },
          ": nothing; expected a number, as there is of the others");
  refused([](auto& a, auto&) { a.erase("texture.mean"); }, "texture.mean");
  refused([](auto& a, auto&) { a["more"] = tensor_of(std::vector<float>{1}); }, "tensors");
  refused([](auto& a, auto&) { a["shadow.last.b"] = tensor_of(std::vector<float>{std::nanf("")}); },
          "shadow.last.b");
  TrainOptions other = options;
  other.shading = 3;
  ATELIER_EXPECT_REFUSED(start_training(data, other), LogicError, "power of 2");
  other = options;
  other.channels = 3;
  ATELIER_EXPECT_REFUSED(require_same_training(training, data, other), DataError, "channels");
  other = options;
  other.seed = 9;
  ATELIER_EXPECT_REFUSED(require_same_training(training, data, other), DataError, "options");
  AppearanceData changed = data;
  changed.views[0].colors[0] ^= 1;
  ATELIER_EXPECT_REFUSED(require_same_training(training, changed, options), DataError,
                         "other data");
  ATELIER_EXPECT_REFUSED(training_of(tensors, texts), DataError, "training");
}

}  // namespace
}  // namespace atelier
