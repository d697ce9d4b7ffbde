#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/encoded_frames.h"
#include "appearance/network/train.h"
#include "core/error.h"
#include "tests/appearance_network/appearance_fixture.h"
#include "tests/appearance_network/peers_fixture.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using fixtures::nudge;
using fixtures::small_data;

constexpr float kBend = 0.4F;        // rad, from frame to frame
constexpr float kSwelling = 0.004F;  // m a radian

float bend_of(int frame) {
  return kBend * static_cast<float>(frame - 1);
}

FloatRows bent_sheet(const FloatRows& rest, float bend) {
  FloatRows position = rest;
  const Eigen::AngleAxisf turn(bend, Eigen::Vector3f::UnitZ());
  const Eigen::Vector3f hinge(0.5F, 0, 0);
  for (Index v = 0; v < rest.rows(); ++v) {
    if (rest(v, 0) > 0.5F) {
      position.row(v) = turn * (rest.row(v).transpose() - hinge) + hinge;
    }
  }
  return position;
}

/// A sheet of two parts that bends in the middle, and swells on the bent side as far as it bends.
AppearanceData bent_data() {
  AppearanceData data = small_data();
  BodyShapes body;
  const Mesh flat = fixtures::grid(6, 6);
  body.parts.rest = flat.vertices.cast<float>();
  body.parts.parents = {0, 0};
  for (Index v = 0; v < flat.vertices.rows(); ++v) {
    body.parts.part.push_back(flat.vertices(v, 0) > 0.5 ? 1 : 0);
  }
  for (int f = 0; f < 3; ++f) {
    data.frames[static_cast<std::size_t>(f)].position = bent_sheet(body.parts.rest, bend_of(f));
    FloatRows offset = FloatRows::Zero(flat.vertices.rows(), 3);
    for (Index v = 0; v < offset.rows(); ++v) {
      offset(v, 1) = body.parts.part[static_cast<std::size_t>(v)] == 1 ? kSwelling * bend_of(f) : 0;
    }
    body.offset.push_back(offset);
    body.support.emplace_back(Eigen::VectorXf::Ones(offset.rows()));
  }
  data.body = std::move(body);
  return data;
}

TrainOptions coded_options(int iterations = 8) {
  TrainOptions options;
  options.resolution = 16;
  options.channels = 2;
  options.iterations = iterations;
  options.learning_rate = 1e-2;
  options.code = {.pose = true, .latent = 3, .geometry = true, .losses = {}};
  return options;
}

AppearanceModel coded_model(const AppearanceData& data, const TrainOptions& options,
                            std::uint64_t seed = 3) {
  return initial_model(data, network_options(options, 2), seed);
}

TEST(BodyCode, Gradients_MatchFiniteDifferences) {
  const AppearanceData data = bent_data();
  TrainOptions options = coded_options();
  AppearanceModel model = coded_model(data, options);
  for (const char* last : {"code.last.g", "independent.last.g", "dependent.last.g", "shadow.last.g",
                           "offset.last.g"}) {
    for (std::size_t i = 0; i < model.parameters.at(last).data.size() / 4; ++i) {
      nudge(model, last, i, 0.1F);
    }
  }
  // Where no pose is felt, LeakyReLU would be at its kink.
  for (std::size_t i = 0; i < model.parameters.at("pose.first.b").data.size() / 4; ++i) {
    nudge(model, "pose.first.b", i, 0.05F);
  }
  fixtures::expect_gradients(model, data, {0, 3},
                             {.divergence = 1e-3, .geometry = 0.01, .bending = 0.01});
}

TEST(BodyCode, UntrainedNetwork_MovesNothing) {
  const AppearanceData data = bent_data();
  const AppearanceNetwork network(coded_model(data, coded_options()), Device::Cpu);
  EXPECT_EQ(network.offsets(data.frames[2].position).cwiseAbs().maxCoeff(), 0);
}

TEST(BodyCode, SwellingOfTrainingPoses_IsLearntAndInterpolated) {
  const AppearanceData data = bent_data();
  TrainOptions options = coded_options(800);
  options.channels = 4;
  options.learning_rate = 3e-3;
  options.code.losses.geometry = 0.1;
  options.code.losses.bending = 0.1;
  options.code.latent = 0;  // which would be told of it, too
  const TrainResult trained = train(start_training(data, options), data, options, Device::Cpu);
  const AppearanceNetwork network(trained.training.model, Device::Cpu);
  for (const float bend : {-kBend, 0.5F * kBend, kBend}) {
    const Points offset = network.offsets(bent_sheet(data.body->parts.rest, bend));
    double sum = 0;
    double count = 0;
    for (Index v = 0; v < offset.rows(); ++v) {
      if (data.body->parts.rest(v, 0) > 0.7F) {
        sum += offset(v, 1);
        count += 1;
      }
    }
    EXPECT_NEAR(sum / count, kSwelling * bend, 0.0005) << bend << " rad";
  }
}

/// What makes a frame brighter without a change of pose goes to the latent code, and drawing is
/// between the frames.
TEST(BodyCode, UnexplainedBrightness_IsOfTheLatentCode) {
  AppearanceData data = bent_data();
  for (SurfaceFrame& frame : data.frames) {
    frame.position = data.body->parts.rest;
    frame.normal = data.frames[0].normal;
    frame.transfer = data.frames[0].transfer;
  }
  for (AppearanceView& view : data.views) {
    std::fill(view.colors.begin(), view.colors.end(),
              static_cast<std::uint8_t>(100 + 40 * view.frame_idx));
  }
  TrainOptions options = coded_options(500);
  options.channels = 4;
  options.learning_rate = 1e-3;
  double last = 0;
  TrainHooks hooks;
  hooks.step = [&](std::int64_t i, const NetworkLoss& loss, double) {
    last += i > options.iterations - 100 ? loss.value / 100 : 0;
  };
  const AppearanceModel coded =
      train(start_training(data, options), data, options, Device::Cpu, hooks).training.model;
  const double unexplained = 2.0 / 3 * 40 * 40 / (255.0 * 255.0);  // of one brightness for all
  EXPECT_LT(last, 0.3 * unexplained);
  const AppearanceNetwork network(coded, Device::Cpu);
  const std::vector<float> drawn =
      network.colors(data.frames[0], data.centers.row(0), {{0.5F}, {0.5F}, {}});
  EXPECT_NEAR(drawn[0], 0.26, 0.05) << "as bright as the middle frame, in linear light";
}

/// A sheet that does not bend, whose second part has a face of one point and is brighter the
/// farther that is to one side.
AppearanceData faced_data() {
  AppearanceData data = bent_data();
  data.body->parts = with_face(data.body->parts, 1, 1);
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    SurfaceFrame& frame = data.frames[f];
    frame.position = data.body->parts.rest;
    frame.normal = data.frames[0].normal;
    frame.transfer = data.frames[0].transfer;
    frame.face = {static_cast<float>(f) - 1, 0, 0};
    data.body->offset[f].setZero();
  }
  for (AppearanceView& view : data.views) {
    for (std::size_t i = 0; i < view.u.size(); ++i) {
      const int own = view.u[i] > 0.5F ? 40 * view.frame_idx : 40;
      std::fill_n(view.colors.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                  static_cast<std::uint8_t>(100 + own));
    }
  }
  return data;
}

TEST(BodyCode, FaceOfTheFrames_IsLearntAndDrawnOnItsPartAlone) {
  const AppearanceData data = faced_data();
  TrainOptions options = coded_options(500);
  options.channels = 4;
  options.code.latent = 0;
  const AppearanceModel trained =
      train(start_training(data, options), data, options, Device::Cpu).training.model;
  ASSERT_EQ(trained.options.pose_parts, 3);
  const AppearanceNetwork network(trained, Device::Cpu);
  const auto drawn = [&](const std::vector<float>& face, float u) {
    SurfaceFrame frame = data.frames[0];
    frame.face = face;
    return network.colors(frame, data.centers.row(0), {{u}, {0.5F}, {}})[0];
  };
  constexpr float kFace = 0.8F;
  constexpr float kBesideIt = 0.15F;
  EXPECT_NEAR(drawn({-1, 0, 0}, kFace), 0.127, 0.03) << "100 of 255, in linear light";
  EXPECT_NEAR(drawn({1, 0, 0}, kFace), 0.456, 0.06) << "180";
  EXPECT_NEAR(drawn({}, kFace), drawn({0, 0, 0}, kFace), 1e-6) << "none is the mean";
  EXPECT_NEAR(drawn({9, 0, 0}, kFace), drawn({1, 0, 0}, kFace), 1e-6) << "as far as was learnt";
  EXPECT_NEAR(drawn({1, 0, 0}, kBesideIt), drawn({-1, 0, 0}, kBesideIt), 0.03);
}

TEST(BodyCode, Faces_SurviveTheirFile) {
  const AppearanceData data = faced_data();
  const AppearanceData back = appearance_data_of(archive_of(data));
  EXPECT_EQ(back.frames[2].face, data.frames[2].face);
  EXPECT_EQ(face_points(back.body->parts), 1);
  const AppearanceModel model = initial_model(data, network_options(coded_options(), 3), 1);
  EXPECT_EQ(face_points(*appearance_model_of(tensors_of(model), texts_of(model)).parts), 1);
}

TEST(BodyCodeRefused, FacesThatDoNotFit_AreRefused) {
  AppearanceData data = faced_data();
  data.frames[1].face = {1, 2, 3, 4, 5, 6};
  ATELIER_EXPECT_REFUSED(check_appearance_data(data, "d.h5"), DataError, "frames/face");
  data = faced_data();
  data.frames[1].face.clear();
  ATELIER_EXPECT_REFUSED(check_appearance_data(data, "d.h5"), DataError, "frames/face");
  Archive archive = archive_of(faced_data());
  archive.datasets["frames/face"] = tensor_of(std::vector<float>(9, 1e6F), {3, 3});
  ATELIER_EXPECT_REFUSED(appearance_data_of(archive, "d.h5"), DataError, "frames/face");
}

TEST(BodyCode, EncodedFrames_HoldOffsetsAndResiduals) {
  const AppearanceData data = bent_data();
  const AppearanceModel model = coded_model(data, coded_options());
  const std::vector<Image> encoded = encoded_frames(data, model);
  ASSERT_EQ(encoded.size(), 3U);
  ASSERT_EQ(encoded[2].channels, kEncodedChannels);
  const std::size_t right = kEncodedChannels * (8 * 16 + 13);  // a texel of the bent side
  EXPECT_NEAR(encoded[2].data[right + 1], 100 * kSwelling * kBend, 1e-3);
  EXPECT_NEAR(encoded[2].data[right + 3], 1, 1e-5) << "support";
  EXPECT_EQ(encoded[2].data[right + 7], 1) << "seen";
  float most = 0;
  for (std::size_t i = 0; i < encoded[0].data.size(); i += kEncodedChannels) {
    most = std::max(most, std::abs(encoded[0].data[i + 4]));
  }
  EXPECT_GT(most, 0.01F) << "frames differ from the static texture";
  EXPECT_LE(most, 1.0F);
}

TEST(BodyCode, PosesBeyondTheTrainingFrames_AreTakenForTheNearest) {
  const AppearanceData data = bent_data();
  AppearanceModel model = coded_model(data, coded_options());
  for (std::size_t i = 0; i < 3; ++i) {
    nudge(model, "offset.last.g", i, 0.2F);
  }
  const AppearanceNetwork network(model, Device::Cpu);
  const FloatRows& rest = data.body->parts.rest;
  const Points last = network.offsets(bent_sheet(rest, kBend));
  EXPECT_LT((network.offsets(bent_sheet(rest, 3 * kBend)) - last).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_GT((network.offsets(bent_sheet(rest, 0.5F * kBend)) - last).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(BodyCode, CentredCodes_ChangeNothingButTheirMean) {
  const AppearanceData data = bent_data();
  TrainOptions options = coded_options();
  AppearanceModel model = coded_model(data, options);
  for (const char* last : {"code.last.g", "offset.last.g"}) {
    for (std::size_t i = 0; i < 3; ++i) {
      nudge(model, last, i, 0.2F);
    }
  }
  AppearanceNetwork network(model, Device::Cpu);
  network.learn_from(data, {.divergence = 0, .geometry = 0.1, .bending = 0});
  const double before = network.loss({0, 1, 2, 3, 4, 5}).value;
  const Points drawn = network.offsets(data.frames[0].position);
  network.center_codes();
  EXPECT_NEAR(network.loss({0, 1, 2, 3, 4, 5}).value, before, 1e-5 * before);
  EXPECT_GT((network.offsets(data.frames[0].position) - drawn).cwiseAbs().maxCoeff(), 1e-7)
      << "but a code of zeros is another one now";
  const Points centred = network.offsets(data.frames[0].position);
  network.center_codes();
  EXPECT_LT((network.offsets(data.frames[0].position) - centred).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(BodyCode, ResumedTraining_IsBitIdentical) {
  const AppearanceData data = bent_data();
  const TrainOptions options = coded_options(12);
  const TrainResult whole = train(start_training(data, options), data, options, Device::Cpu);
  std::int64_t seen = 0;
  TrainHooks hooks;
  hooks.step = [&](std::int64_t iteration, const NetworkLoss&, double) { seen = iteration; };
  hooks.stop = [&] { return seen == 7; };
  const TrainResult half = train(start_training(data, options), data, options, Device::Cpu, hooks);
  const Training read = training_of(tensors_of(half.training), texts_of(half.training));
  require_same_training(read, data, options);
  const TrainResult rest = train(read, data, options, Device::Cpu);
  for (const auto& [name, tensor] : whole.training.model.parameters) {
    EXPECT_EQ(rest.training.model.parameters.at(name).data, tensor.data) << name;
  }
}

/// Noise, divergence and geometry, too, are as of one process with twice the batch.
TEST(BodyCode, TwoProcesses_GiveTheWeightsOfOneWithTwiceTheBatch) {
  const AppearanceData data = bent_data();
  TrainOptions halves = coded_options(24);
  halves.batch = 1;
  halves.learning_rate = 1e-3;
  TrainOptions whole = halves;
  whole.iterations = 12;
  whole.batch = 2;
  const TrainResult one = train(start_training(data, whole), data, whole, Device::Cpu);
  const auto two = fixtures::train_together(start_training(data, halves), data, halves, {{}, {}});
  EXPECT_LT(fixtures::largest_difference(one.training.model, two[0].training.model), 1e-5);
  EXPECT_EQ(fixtures::largest_difference(two[0].training.model, two[1].training.model), 0);
}

TEST(BodyCode, DataAndNetwork_SurviveTheirFiles) {
  const AppearanceData data = bent_data();
  const AppearanceData back = appearance_data_of(archive_of(data));
  ASSERT_TRUE(back.body);
  EXPECT_EQ(back.body->parts.part, data.body->parts.part);
  EXPECT_EQ(back.body->parts.parents, data.body->parts.parents);
  EXPECT_TRUE(equal_arrays(back.body->parts.rest, data.body->parts.rest));
  EXPECT_TRUE(equal_arrays(back.body->offset[2], data.body->offset[2]));
  EXPECT_TRUE(equal_arrays(back.body->support[1], data.body->support[1]));
  const AppearanceModel model = coded_model(data, coded_options());
  const AppearanceModel read = appearance_model_of(tensors_of(model), texts_of(model));
  ASSERT_TRUE(read.parts);
  EXPECT_EQ(read.parts->part, model.parts->part);
  EXPECT_EQ(read.options.latent, 3);
  EXPECT_TRUE(read.options.geometry);
}

TEST(BodyCodeRefused, DamagedParts_AreRefused) {
  const AppearanceData data = bent_data();
  const AppearanceModel model = coded_model(data, coded_options());
  std::map<std::string, Tensor> tensors = tensors_of(model);
  tensors["body.parent"] = tensor_of(std::vector<int>{0, 1});
  ATELIER_EXPECT_REFUSED(appearance_model_of(tensors, texts_of(model), "m"), DataError, "m");
  tensors = tensors_of(model);
  tensors["body.pose_low"] = tensor_of(std::vector<float>(6, 9.0F));
  ATELIER_EXPECT_REFUSED(appearance_model_of(tensors, texts_of(model), "m"), DataError,
                         "range of poses");
  tensors = tensors_of(model);
  tensors.erase("body.rest");
  ATELIER_EXPECT_REFUSED(appearance_model_of(tensors, texts_of(model), "m"), DataError, "m");
  Archive archive = archive_of(data);
  archive.datasets["frames/support"] = tensor_of(std::vector<float>(3 * 49, 2.0F), {3, 49});
  ATELIER_EXPECT_REFUSED(appearance_data_of(archive, "d.h5"), DataError, "frames/support");
  archive = archive_of(data);
  archive.datasets["body/part"] = tensor_of(std::vector<int>(49, 5));
  ATELIER_EXPECT_REFUSED(appearance_data_of(archive, "d.h5"), DataError, "body/part");
}

TEST(BodyCodeRefused, PoseWithoutABody_IsRefused) {
  const AppearanceData data = small_data();
  TrainOptions options = coded_options();
  EXPECT_THROW(initial_model(data, network_options(options, 2), 1), DataError);
  options.code.pose = false;
  const AppearanceModel model = initial_model(data, network_options(options, 0), 1);
  AppearanceNetwork network(model, Device::Cpu);
  EXPECT_THROW(network.learn_from(data), DataError) << "geometry has nothing to learn from";
}

/// Networks of before had no code, and their files say nothing of it.
TEST(BodyCode, FileOfANetworkWithoutCode_IsRead) {
  const AppearanceData data = small_data();
  TrainOptions options = coded_options();
  options.code = {};
  const AppearanceModel model = initial_model(data, network_options(options), 1);
  EXPECT_EQ(model.options.latent, 0);
  const AppearanceModel read = appearance_model_of(tensors_of(model), texts_of(model));
  EXPECT_FALSE(read.parts);
  EXPECT_FALSE(has_code(read.options));
}

}  // namespace
}  // namespace atelier
