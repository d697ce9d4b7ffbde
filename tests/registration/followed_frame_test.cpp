// What `register` keeps of every frame: read back as it was, refused where it is another's, and
// enough to go on from after a stop, or beside another run, to the same bits.
#include "registration/tracking/followed_frame.h"

#include <limits>
#include <map>
#include <mutex>
#include <numbers>
#include <set>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/archive_arrays.h"
#include "core/error.h"
#include "registration/tracking/register_sequence.h"
#include "tests/registration/registered_shapes.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

constexpr Index kRows = 8;
constexpr Index kTemplateRow = 3;
constexpr double kTurn = 0.04;  // a frame

/// Thrown where a run is stopped.
struct Stop {};

/// A printed tube that turns with the body in it, frame by frame. A quarter of it is in no image
/// of the first frames, so that later ones add to what is known of its print.
struct Turning {
  Garment garment;
  RegistrationSource source;
  RegisterSequenceOptions options;

  Turning() {
    garment.name = "tube";
    garment.mesh = fixtures::cloth_tube(16, 8);
    Mesh body = fixtures::sphere(2);
    body.vertices.col(0) *= 0.13;
    body.vertices.col(2) *= 0.10;
    body.vertices.col(1) = 0.35 * body.vertices.col(1).array() + 1.05;
    const Mesh fine = fixtures::cloth_tube(30, 16);
    options.fit.rounds = 3;
    options.fit.photometric_levels = 2;
    options.fit.photometric_steps = 2;
    options.fit.sample_spacing = 0.02;
    source.rows = kRows;
    source.template_row = kTemplateRow;
    source.body_faces = body.faces;
    const auto angle = [](Index row) { return kTurn * static_cast<double>(row - kTemplateRow); };
    source.body = [=](Index row) { return fixtures::screwed(body.vertices, angle(row), 0); };
    source.load = [=](Index row) {
      RegistrationFrame frame;
      frame.scan = garment_scan(fine, {});
      frame.body = body_obstacle(fixtures::screwed(body.vertices, angle(row), 0), body.faces);
      frame.views = fixtures::cylinder_views(
          2, [=](double u, double y) { return fixtures::blotches(u - angle(row), y); });
      frame.views.resize(row == kTemplateRow ? 3 : 4);
      return frame;
    };
  }
};

/// Frames kept in memory, as files would be.
struct Shelf {
  std::mutex mutex;
  std::map<Index, Archive> frames;
  std::set<Index> reserved;
  int followed = 0;

  FrameKeeping keeping() {
    FrameKeeping keeping;
    keeping.read = [this](Index row,
                          const RegistrationModel& model) -> std::optional<FollowedFrame> {
      const std::lock_guard lock(mutex);
      const auto found = frames.find(row);
      if (found == frames.end()) {
        return std::nullopt;
      }
      return followed_frame_of(found->second, "tube", model.vertices.rows(),
                               static_cast<Index>(model.samples.areas.size()));
    };
    keeping.write = [this](Index row, const FollowedFrame& frame) {
      const std::lock_guard lock(mutex);
      frames[row] = archive_of(frame, "tube");
      ++followed;
    };
    keeping.reserve = [this](Index row) -> std::shared_ptr<void> {
      const std::lock_guard lock(mutex);
      if (!reserved.insert(row).second) {
        return nullptr;
      }
      return {this, [row](Shelf* shelf) {
                const std::lock_guard moment(shelf->mutex);
                shelf->reserved.erase(row);
              }};
    };
    return keeping;
  }
};

const std::vector<RegisteredGarment>& uninterrupted() {
  static const std::vector<RegisteredGarment> frames = [] {
    Turning turning;
    RegisteredSequence sequence(turning.garment, turning.source, turning.options);
    std::vector<RegisteredGarment> all;
    for (Index row = 0; row < kRows; ++row) {
      all.push_back(sequence.at(row));
    }
    return all;
  }();
  return frames;
}

void expect_same(const RegisteredGarment& a, const RegisteredGarment& b, Index row) {
  EXPECT_EQ(a.vertices, b.vertices) << row;
  EXPECT_EQ(a.confidence, b.confidence) << row;
  EXPECT_EQ(a.vertex_correlation, b.vertex_correlation) << row;
  EXPECT_EQ(a.scan_rms, b.scan_rms) << row;
  EXPECT_EQ(a.correlation, b.correlation) << row;
  EXPECT_EQ(a.picture_steps, b.picture_steps) << row;
  EXPECT_EQ(a.contact.crossings, b.contact.crossings) << row;
}

TEST(FollowedFrame, TestSequence_HasEverythingAChainCarries) {
  Shelf shelf;
  Turning turning;
  turning.source.keeping = shelf.keeping();
  RegisteredSequence sequence(turning.garment, turning.source, turning.options);
  sequence.at(kTemplateRow + 2);
  const Archive& next = shelf.frames.at(kTemplateRow + 1);
  for (const char* name : {"vertices", "confidence", "told", "drift", "gain_samples"}) {
    EXPECT_NE(find_array(next, name), nullptr) << name;
  }
  EXPECT_GT(uninterrupted()[kTemplateRow + 1].correlation, 0.5);
}

TEST(FollowedFrame, StopAfterAnyFrame_ResumesBitIdentical) {
  for (const int until : {0, 1, 4, 6}) {
    Shelf shelf;
    Turning turning;
    ASSERT_GE(turning.options.window, kRows);  // one window, as long as it is by default
    turning.source.keeping = shelf.keeping();
    RegistrationSource stopped = turning.source;
    int begun = 0;
    stopped.before_frame = [&] {
      if (begun++ == until) {
        throw Stop();
      }
    };
    {
      RegisteredSequence sequence(turning.garment, stopped, turning.options);
      EXPECT_THROW(
          {
            for (Index row = 0; row < kRows; ++row) {
              sequence.at(row);
            }
          },
          Stop);
    }
    EXPECT_EQ(shelf.followed, 1 + until);  // the template's own, and those that were finished
    RegisteredSequence sequence(turning.garment, turning.source, turning.options);
    for (Index row = 0; row < kRows; ++row) {
      expect_same(sequence.at(row), uninterrupted()[static_cast<std::size_t>(row)], row);
    }
    EXPECT_EQ(shelf.followed, kRows) << "no frame twice";
  }
}

/// Follows all frames of a shelf, which comes to the uninterrupted ones, and again after `lose` has
/// taken one of them away or spoilt it: that one alone is followed again.
template <class Lose>
void expect_one_followed_again(const Lose& lose) {
  Shelf shelf;
  Turning turning;
  turning.source.keeping = shelf.keeping();
  for (const bool again : {false, true}) {
    RegisteredSequence sequence(turning.garment, turning.source, turning.options);
    for (Index row = 0; row < kRows; ++row) {
      expect_same(sequence.at(row), uninterrupted()[static_cast<std::size_t>(row)], row);
    }
    EXPECT_EQ(shelf.followed, again ? kRows + 1 : kRows);
    lose(shelf, sequence.model());
  }
}

TEST(FollowedFrame, LostFrame_IsTheOnlyOneTrackedAgain) {
  for (const Index lost : {Index{1}, kTemplateRow, Index{5}}) {
    expect_one_followed_again(
        [&](Shelf& shelf, const RegistrationModel& /*model*/) { shelf.frames.erase(lost); });
  }
}

// A file may have been tampered with: nothing that it says is an error of the program.
TEST(FollowedFrame, FrameOfAnotherTexture_IsTrackedAgain) {
  for (const Index tampered : {Index{1}, kTemplateRow, Index{5}}) {
    for (const TextureGain& gain :
         {TextureGain{3, 3, {0}, std::vector<float>(9, 0.5F)},
          TextureGain{2, 3, {0}, std::vector<float>(6, 0.5F)}, TextureGain{1, 3, {}, {}}}) {
      expect_one_followed_again([&](Shelf& shelf, const RegistrationModel& model) {
        FollowedFrame other =
            followed_frame_of(shelf.frames.at(tampered), "tube", model.vertices.rows(),
                              static_cast<Index>(model.samples.areas.size()));
        other.gain = gain;
        shelf.frames[tampered] = archive_of(other, "tube");
      });
    }
  }
}

TEST(FollowedFrame, GainOfAnotherTexture_IsRefused) {
  GarmentTexture texture;
  add_gain(texture, {2, 1, {1}, {0.1F, 0.2F}}, 3);
  EXPECT_EQ(texture.levels.size(), 2U);
  ATELIER_EXPECT_REFUSED(add_gain(texture, {1, 1, {1}, {0.1F}}, 3), DataError, "gain");
  ATELIER_EXPECT_REFUSED(add_gain(texture, {2, 3, {}, {}}, 3), DataError, "gain");
}

// As two processes would: each with a sequence of its own, and every other frame.
TEST(FollowedFrame, Shards_ShareTrackedFrames) {
  for (const int window : {48, 2}) {
    Shelf shelf;
    std::vector<std::jthread> shards;
    std::map<Index, RegisteredGarment> found;
    for (Index shard = 0; shard < 2; ++shard) {
      shards.emplace_back([&, shard] {
        Turning turning;
        turning.options.window = window;
        turning.source.keeping = shelf.keeping();
        RegisteredSequence sequence(turning.garment, turning.source, turning.options);
        for (Index row = shard; row < kRows; row += 2) {
          const RegisteredGarment& garment = sequence.at(row);
          const std::lock_guard lock(shelf.mutex);
          found[row] = garment;
        }
      });
    }
    shards.clear();
    Turning turning;
    turning.options.window = window;
    RegisteredSequence alone(turning.garment, turning.source, turning.options);
    for (Index row = 0; row < kRows; ++row) {
      expect_same(found.at(row), alone.at(row), row);
    }
    EXPECT_GE(shelf.followed, kRows);
    EXPECT_LE(shelf.followed, kRows + 1);  // the template's own at most by both
  }
}

FollowedFrame some_frame() {
  FollowedFrame frame;
  frame.garment.vertices = Points::Random(3, 3);
  frame.garment.confidence = Eigen::VectorXf::Constant(3, 0.3F);
  frame.garment.vertex_correlation = Eigen::Vector3d(0.1, 1.0 / 3, 0);
  frame.garment.inverted = 2;
  frame.garment.contact = {0.25, 0.001, 7};
  frame.drift = Points::Random(3, 3);
  frame.gain = {2, 1, {1, 4}, {0.1F, 0.2F, 0.3F, 0.4F}};
  return frame;
}

TEST(FollowedFrame, WrittenFrame_ReadsBackEqual) {
  const FollowedFrame frame = some_frame();
  const FollowedFrame back = followed_frame_of(archive_of(frame, "key a 1"), "key a 1", 3, 5);
  EXPECT_EQ(back.garment.vertices, frame.garment.vertices);
  EXPECT_EQ(back.garment.vertex_correlation, frame.garment.vertex_correlation);
  EXPECT_EQ(back.garment.inverted, 2);
  EXPECT_EQ(back.garment.contact.depth, 0.001);
  EXPECT_EQ(back.drift, frame.drift);
  EXPECT_EQ(back.gain.samples, frame.gain.samples);
  EXPECT_EQ(back.gain.values, frame.gain.values);
  FollowedFrame bare = frame;
  bare.drift.resize(0, 3);
  bare.garment.vertex_correlation.resize(0);
  bare.gain = {2, 3, {}, {}};  // images that showed nothing new
  const FollowedFrame bare_back = followed_frame_of(archive_of(bare, "k"), "k", 3, 5);
  EXPECT_EQ(bare_back.drift.rows(), 0);
  EXPECT_EQ(bare_back.garment.vertex_correlation.size(), 0);
  EXPECT_EQ(bare_back.gain.levels, 2);
}

TEST(FollowedFrame, FrameOfOtherInputOrMalformed_IsRefused) {
  const Archive good = archive_of(some_frame(), "key a 1");
  const auto read = [](const Archive& archive, Index vertices = 3, Index samples = 5) {
    return followed_frame_of(archive, "key a 1", vertices, samples, "000001.h5");
  };
  ATELIER_EXPECT_REFUSED(followed_frame_of(good, "key a 2", 3, 5), DataError, "made_of");
  ATELIER_EXPECT_REFUSED(read(good, 4), DataError, "vertices");
  ATELIER_EXPECT_REFUSED(read(good, 3, 4), DataError, "gain_samples");
  const auto broken = [&](const std::function<void(Archive&)>& change) {
    Archive archive = good;
    change(archive);
    return archive;
  };
  for (const char* missing : {"vertices", "confidence", "gain_values"}) {
    ATELIER_EXPECT_REFUSED(read(broken([&](Archive& a) { a.datasets.erase(missing); })), DataError,
                           missing);
  }
  ATELIER_EXPECT_REFUSED(read(broken([](Archive& a) { a.texts.clear(); })), DataError, "made_of");
  ATELIER_EXPECT_REFUSED(read(broken([](Archive& a) { a.numbers.erase("seen"); })), DataError,
                         "seen");
  ATELIER_EXPECT_REFUSED(read(broken([](Archive& a) { a.numbers["inverted"] = -1; })), DataError,
                         "inverted");
  ATELIER_EXPECT_REFUSED(read(broken([](Archive& a) { a.numbers["gain_levels"] = 1e9; })),
                         DataError, "gain_levels");
  ATELIER_EXPECT_REFUSED(read(broken([](Archive& a) {
                           a.datasets["gain_samples"] = tensor_of(std::vector<int>{4, 4});
                         })),
                         DataError, "not in order");
  ATELIER_EXPECT_REFUSED(read(broken([](Archive& a) {
                           a.datasets["told"] = tensor_of(
                               std::vector<double>{0, std::numeric_limits<double>::quiet_NaN(), 0});
                         })),
                         DataError, "told");
}

}  // namespace
}  // namespace atelier
