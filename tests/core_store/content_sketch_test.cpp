// What tells a capture again after it was moved and has changed.

#include "core/store/content_sketch.h"

#include <gtest/gtest.h>

#include "core/store/manifest.h"

namespace atelier::fixtures {
namespace {

/// Numbers of files that no other seed has.
std::vector<std::uint64_t> files(std::size_t count, std::uint64_t seed) {
  std::vector<std::uint64_t> numbers;
  for (std::size_t i = 0; i < count; ++i) {
    const Digest digest = sha256(std::to_string(seed) + "/" + std::to_string(i));
    std::uint64_t number = 0;
    for (std::size_t k = 0; k < sizeof number; ++k) {
      number = number << 8 | digest[k];
    }
    numbers.push_back(number);
  }
  return numbers;
}

std::vector<std::uint64_t> joined(std::vector<std::uint64_t> a,
                                  const std::vector<std::uint64_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(ContentSketch, GrownInput_HoldsTheFormerOne) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{5}, kSketchSize - 1, kSketchSize,
                                  kSketchSize + 1, std::size_t{10000}}) {
    for (const std::size_t more : {0, 1, 40, 30000}) {
      const ContentSketch before = content_sketch(files(count, 1));
      const ContentSketch after = content_sketch(joined(files(count, 1), files(more, 2)));
      const SharedFiles shared = shared_files(before, after);
      EXPECT_EQ(shared.shared, shared.compared) << count << " and " << more;
      EXPECT_EQ(holds_mostly(before, after), shared.compared > 0);
    }
  }
}

TEST(ContentSketch, OtherInputOfTheSameRig_IsNotHeld) {
  const std::vector<std::uint64_t> rig = files(60, 9);  // calibrations, backgrounds
  const ContentSketch one = content_sketch(joined(rig, files(60, 1)));
  const ContentSketch two = content_sketch(joined(rig, files(900, 2)));
  EXPECT_FALSE(holds_mostly(one, two));
  EXPECT_FALSE(holds_mostly(two, one));
}

TEST(ContentSketch, ShareOfFiles_IsEstimated) {
  // 2,000 of 10,000 files are others: a sample of 256 has 205 of the rest, give or take 6.4.
  const std::vector<std::uint64_t> kept = files(8000, 1);
  const SharedFiles shared = shared_files(content_sketch(joined(kept, files(2000, 2))),
                                          content_sketch(joined(kept, files(2000, 3))));
  EXPECT_GT(shared.compared, 150u);
  EXPECT_NEAR(static_cast<double>(shared.shared) / static_cast<double>(shared.compared), 0.8, 0.1);
}

TEST(ContentSketch, EqualFilesAndNone_CountOnceAndNotAtAll) {
  EXPECT_EQ(content_sketch({7, 7, 3, 7}), (ContentSketch{3, 7}));
  EXPECT_EQ(shared_files({}, {1}).compared, 0u);
  EXPECT_FALSE(holds_mostly({}, {}));
  EXPECT_FALSE(holds_mostly({1}, {}));
}

TEST(ContentSketch, InputsThatDiffer_AreDescribed) {
  const ManifestInput a{"capture", "/a", sha256("a"), 4, 40, "", {}, {1, 2, 3, 4}};
  ManifestInput b{"capture", "/b", sha256("b"), 2, 20, "", {}, {1, 9}};
  EXPECT_FALSE(is_same_input(a, b));
  EXPECT_EQ(input_difference(a, b),
            "4 files, 40 bytes there, 2 files, 20 bytes here; of 4 files there that were compared "
            "1 is here");
  b.sketch = {9};
  EXPECT_EQ(input_difference(b, a),
            "2 files, 20 bytes there, 4 files, 40 bytes here; of 1 file there that was compared "
            "none is here");
  b.sketch.clear();
  EXPECT_EQ(input_difference(a, b), "4 files, 40 bytes there, 2 files, 20 bytes here");
  b.path = a.path;
  EXPECT_TRUE(is_same_input(a, b));
}

}  // namespace
}  // namespace atelier::fixtures
