#include "capture/frame_locations.h"

#include <cstdio>
#include <iterator>
#include <map>
#include <random>

#include <gmock/gmock.h>

namespace atelier {
namespace {

using Oracle = std::map<int, DataLocation>;

std::string padded(int number, int digits) {
  char text[32];
  std::snprintf(text, sizeof(text), "%0*d", digits, number);
  return text;
}

/// Places as layouts have them, of the `kind`-th of their ways.
DataLocation place_of(int kind, int frame) {
  switch (kind) {
    case 0:
      return {"/c/images/01/" + padded(frame, 6) + ".png", "", -1};
    case 1:
      return {"c/2/" + std::to_string(frame) + ".jpg", "", -1};
    case 2:
      return {"c/cam04/" + padded(frame, 6) + "_cam04.png", "", -1};
    case 3:
      return {"c/video.mp4", "", frame + 3};
    case 4:
      return {"c/main.smc", "Camera_5mp/05/color/" + std::to_string(frame), -1};
    case 5:
      return {"c/main.smc", "Keypoints_2D/05", frame};
    case 6:
      return {"c/cam04.zip", "cam04/" + padded(frame, 4) + ".png", -1};
    case 7:
      return {"c/1/" + std::to_string(1'699'999'999'000'000LL + 33'333LL * frame) + ".json", "",
              -1};
    case 8:
      return {"c/still.png", "", -1};
    case 9:
      return {"c/" + std::string(30, '9') + "_" + std::string(25, '1') + ".png", "", -1};
    default:
      return {"c/f" + padded(frame, 3) + "b" + std::to_string(frame * 7919 % 31) + ".png", "", -1};
  }
}
constexpr int kKinds = 11;

void expect_same(const FrameLocations& places, const Oracle& oracle) {
  ASSERT_EQ(places.size(), oracle.size());
  EXPECT_EQ(places.empty(), oracle.empty());
  auto expected = oracle.begin();
  for (const auto& [frame, place] : places) {
    ASSERT_EQ(frame, expected->first);
    ASSERT_EQ(place, expected->second) << place.file << " " << place.member << " " << place.index;
    ASSERT_EQ(places.find(frame), expected->second);
    ++expected;
  }
  std::vector<int> frames;
  for (const auto& [frame, place] : oracle) {
    frames.push_back(frame);
  }
  EXPECT_EQ(places.frames(), frames);
  if (!oracle.empty()) {
    EXPECT_EQ(places.last_frame(), oracle.rbegin()->first);
    EXPECT_FALSE(places.contains(oracle.rbegin()->first + 1));
  }
}

TEST(FrameLocations, EveryWayOfNaming_GivesBackItsPlaces) {
  for (int kind = 0; kind < kKinds; ++kind) {
    SCOPED_TRACE(kind);
    FrameLocations places;
    Oracle oracle;
    for (const int frame : {0, 1, 2, 5, 9, 10, 11, 99, 100, 101, 999, 1000, 1'000'000}) {
      EXPECT_TRUE(places.add(frame, place_of(kind, frame)));
      oracle.emplace(frame, place_of(kind, frame));
    }
    expect_same(places, oracle);
  }
}

TEST(FrameLocations, RandomChanges_AreThoseOfAMap) {
  std::mt19937 random(7);
  const auto below = [&](int count) {
    return static_cast<int>(random() % static_cast<unsigned>(count));
  };
  FrameLocations places;
  Oracle oracle;
  for (int turn = 0; turn < 6000; ++turn) {
    const int frame = below(60);
    const int kind = below(3) == 0 ? below(kKinds) : 0;
    switch (below(8)) {
      case 0:
      case 1:
      case 2:
      case 3:
        EXPECT_EQ(places.add(frame, place_of(kind, frame)),
                  oracle.emplace(frame, place_of(kind, frame)).second);
        break;
      case 4:
        places.set(frame, place_of(kind, frame));
        oracle[frame] = place_of(kind, frame);
        break;
      case 5:
      case 6:
        EXPECT_EQ(places.erase(frame), oracle.erase(frame) > 0);
        break;
      default: {
        FrameLocations others;
        Oracle same;
        for (int k = frame; k < frame + 4; ++k) {
          others.add(k, place_of(kind, k));
          same.emplace(k, place_of(kind, k));
        }
        places.merge(others);
        oracle.merge(same);
      }
    }
    if (turn % 50 == 0) {
      expect_same(places, oracle);
    }
  }
}

TEST(FrameLocations, ShiftedAndOnly_KeepPlacesUnderOtherFrames) {
  for (int kind = 0; kind < kKinds; ++kind) {
    SCOPED_TRACE(kind);
    FrameLocations places;
    for (const int frame : {0, 1, 2, 3, 4, 8, 9, 20}) {
      places.add(frame, place_of(kind, frame));
    }
    for (const int by : {0, 3, -3, -100}) {
      Oracle oracle;
      for (const auto& [frame, place] : places) {
        if (frame + by >= 0) {
          oracle.emplace(frame + by, place);
        }
      }
      expect_same(places.shifted(by), oracle);
    }
    Oracle some;
    for (const int frame : {1, 2, 8, 20}) {
      some.emplace(frame, place_of(kind, frame));
    }
    expect_same(places.only({-1, 1, 2, 7, 8, 20, 21}), some);
    expect_same(places.only({}), {});
  }
}

TEST(FrameLocations, NumbersThatFollow_TakeNoMemoryAFrame) {
  for (const int kind : {0, 1, 2, 3, 4, 5, 6}) {
    FrameLocations places;
    for (int frame = 0; frame < 20'000; ++frame) {
      places.add(frame, place_of(kind, frame));
    }
    EXPECT_LT(places.bytes(), 2'000U) << kind;
    EXPECT_LT(places.shifted(5).bytes(), 2'000U) << kind;
  }
}

TEST(FrameLocations, NumbersWithGaps_TakeTwentyFourBytesAFrame) {
  for (const int kind : {0, 1, 2, 3, 4, 5, 6, 7}) {
    FrameLocations places;
    for (int frame = 0; frame < 20'000; ++frame) {
      places.add(5 * frame, place_of(kind, 5 * frame));
    }
    EXPECT_LT(places.bytes(), 2U * 24 * 20'000) << kind;  // a vector that grows has up to twice
  }
}

}  // namespace
}  // namespace atelier
