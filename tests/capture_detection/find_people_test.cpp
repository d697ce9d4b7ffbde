// People followed from image to image by small networks, and by the real ones where they are.

#include "capture/detection/find_people.h"

#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/capture_detection/bright_networks.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

ByteImage plain(int value) {
  return ByteImage(320, 240, 3, static_cast<std::uint8_t>(value));
}

TEST(FindPeople, PersonLostAndFoundAgain_IsInTheBrightImages) {
  const PeopleNetworks networks = bright_networks();
  const ImageSequence blinking{{plain(0), plain(255), plain(255), plain(10), plain(230)}, {}};
  const ImageSequence dark{{plain(0)}, {}};
  const auto found = find_people(networks, {blinking, dark, {}}, {});
  ASSERT_EQ(found.size(), 3U);
  std::vector<std::size_t> counts;
  for (const PeopleInImage& people : found[0]) {
    counts.push_back(people.size());
  }
  EXPECT_THAT(counts, ::testing::ElementsAre(0, 1, 1, 0, 1));
  EXPECT_TRUE(found[1][0].empty());
  EXPECT_TRUE(found[2].empty());
  const PersonLandmarks& one = found[0][1][0];
  EXPECT_NEAR(one.points(0, 0), 160, 0.01);
  EXPECT_NEAR(one.points(0, 1), 120, 0.01);
  EXPECT_NEAR(one.next.side, 2.5 * 102 / 256 * 2.5 * 44 * 320 / 224, 0.01);
  EXPECT_GT(one.mask.at(3, 3), 250);
}

TEST(FindPeople, ExpectedCrop_IsLookedAtInsteadOfTheWholeImage) {
  const PersonCrop aside{{80, 60}, 100, 0};
  const auto found = find_people(bright_networks(), {{{plain(255)}, {aside}}}, {});
  ASSERT_EQ(found[0][0].size(), 1U);
  EXPECT_NEAR(found[0][0][0].points(0, 0), 80, 0.01);
  FindPeopleOptions two;
  two.people = 2;
  const auto both = find_people(bright_networks(), {{{plain(255)}, {aside}}}, two);
  ASSERT_EQ(both[0][0].size(), 2U);
  EXPECT_NEAR(both[0][0][1].points(0, 0), 160, 0.01);
}

TEST(FindPeople, TwoCropsOfOnePerson_AreOne) {
  const PersonCrop crop{{160, 120}, 100, 0};
  FindPeopleOptions two;
  two.people = 2;
  const auto found = find_people(bright_networks(), {{{plain(255)}, {crop, crop}}}, two);
  EXPECT_EQ(found[0][0].size(), 1U);
}

TEST(FindPeople, ThreadCount_DoesNotChangeWhatIsFound) {
  const PeopleNetworks networks = bright_networks();
  const std::vector<ImageSequence> sequences(3, {{plain(200), plain(255)}, {}});
  const int threads = thread_count();
  set_thread_count(1);
  const auto one = find_people(networks, sequences, {});
  set_thread_count(4);
  const auto four = find_people(networks, sequences, {});
  set_thread_count(threads);
  for (std::size_t s = 0; s < 3; ++s) {
    ASSERT_EQ(one[s][1].size(), four[s][1].size());
    EXPECT_EQ(one[s][1][0].points, four[s][1][0].points);
  }
}

TEST(FindPeople, CropsAskedFor_AreAnsweredWhateverTheirPresence) {
  const ByteImage dark = plain(0);
  const ByteImage grey(64, 64, 1, 255);
  const auto found = landmarks_of_crops(
      bright_networks(), {{&dark, {{10, 10}, 20, 0}}, {&grey, {{30, 30}, 20, 1}}}, {});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(found[0].presence, 0, 1e-6);
  EXPECT_NEAR(found[1].presence, 1, 1e-6);
  EXPECT_TRUE(landmarks_of_crops(bright_networks(), {}, {}).empty());
}

TEST(FindPeople, DamagedNetworks_AreRefused) {
  PeopleNetworks networks = bright_networks();
  networks.landmarks.resize(networks.landmarks.size() / 2);
  ATELIER_EXPECT_REFUSED(find_people(networks, {{{plain(255)}, {}}}, {}), DataError,
                         "landmarks.onnx");
  networks = bright_networks();
  networks.person = networks.landmarks;
  ATELIER_EXPECT_REFUSED(find_people(networks, {{{plain(255)}, {}}}, {}), DataError, "person.onnx");
  networks = bright_networks();
  networks.landmarks = linear_network(256, {{"rows", {1, 195}, std::vector<float>(195, 0.0F), 0}});
  ATELIER_EXPECT_REFUSED(find_people(networks, {{{plain(255)}, {}}}, {}), DataError,
                         "no output [1,1]");
  ATELIER_EXPECT_REFUSED(find_people(networks, {{{ByteImage(4, 4, 2)}, {}}}, {}), LogicError,
                         "1 or 3 channels");
}

TEST(FindPeople, MissingNetworks_AreToldWithHowToGetThem) {
  const TemporaryDirectory folder;
  ATELIER_EXPECT_REFUSED(read_people_networks(folder.path().string(), LandmarkNetwork::Lite),
                         EnvironmentError, "scripts/detector-networks");
}

TEST(FindPeople, RealNetworks_SeeNobodyWhereNobodyIs) {
  const std::string folder = default_network_folder();
  if (!std::filesystem::exists(std::filesystem::path(folder) / "person.onnx")) {
    GTEST_SKIP() << "no networks at " << folder << " (scripts/detector-networks)";
  }
  const PeopleNetworks networks = read_people_networks(folder, LandmarkNetwork::Lite);
  ByteImage stripes(300, 500, 1);
  for (int y = 0; y < stripes.height; ++y) {
    for (int x = 0; x < stripes.width; ++x) {
      stripes.at(x, y) = static_cast<std::uint8_t>((x / 7 + y / 11) % 2 * 255);
    }
  }
  Limits limits;
  limits.worker_cpu_seconds = 120;
  const auto found = find_people(
      networks, {{{plain(0), plain(255), stripes, ByteImage(1, 1, 3, 9)}, {}}}, {}, limits);
  for (const PeopleInImage& people : found[0]) {
    EXPECT_TRUE(people.empty());
  }
}

}  // namespace
}  // namespace atelier::fixtures
