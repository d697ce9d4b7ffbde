#include <gtest/gtest.h>

#include "tests/hostile/readers.h"
#include "tests/hostile/sandbox.h"

namespace atelier::fixtures {
namespace {

/// Each test reads its inputs in a child process: read or refused by DataError, nothing else.
class Damage : public ::testing::TestWithParam<Reader> {};

TEST_P(Damage, CorpusFile_IsReadOrRefused) {
  const auto files = corpus_of(GetParam());
  ASSERT_FALSE(files.empty()) << "no fuzz/corpus/" << GetParam().name;
  EXPECT_EQ(read_all_in_sandbox(GetParam(), files.size(),
                                [&](std::size_t i) { return bytes_of(files[i]); }),
            "");
}

TEST_P(Damage, SmallFile_IsReadCompletely) {
  EXPECT_LE(std::filesystem::file_size(small_file_of(GetParam())), 4096u);
  EXPECT_NO_THROW(GetParam().read(bytes_of(small_file_of(GetParam()))));
}

TEST_P(Damage, EveryTruncation_IsReadOrRefused) {
  const Bytes small = bytes_of(small_file_of(GetParam()));
  const std::size_t stride = stride_of(GetParam());
  EXPECT_EQ(read_all_in_sandbox(GetParam(), (small.size() + stride - 1) / stride,
                                [&](std::size_t i) {
                                  return Bytes(
                                      small.begin(),
                                      small.begin() + static_cast<std::ptrdiff_t>(i * stride));
                                }),
            "");
}

TEST_P(Damage, EveryFlippedBit_IsReadOrRefused) {
  const Bytes small = bytes_of(small_file_of(GetParam()));
  const std::size_t stride = stride_of(GetParam());
  EXPECT_EQ(read_all_in_sandbox(GetParam(), (8 * small.size() + stride - 1) / stride,
                                [&](std::size_t i) {
                                  const std::size_t bit = i * stride;
                                  Bytes flipped = small;
                                  flipped[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
                                  return flipped;
                                }),
            "");
}

TEST_P(Damage, EveryMutation_IsReadOrRefused) {
  std::vector<Bytes> corpus;
  for (const auto& path : corpus_of(GetParam())) {
    corpus.push_back(bytes_of(path));
  }
  ASSERT_FALSE(corpus.empty());
  EXPECT_EQ(
      read_all_in_sandbox(GetParam(), mutations_of(GetParam()),
                          [&](std::size_t i) { return mutated(corpus[i % corpus.size()], i); }),
      "");
}

TEST_P(Damage, EmptyOrUniformFile_IsRefused) {
  // An empty file and a file of one kind of byte are the commonest damage after a power loss.
  EXPECT_EQ(read_all_in_sandbox(GetParam(), 6,
                                [&](std::size_t i) {
                                  return Bytes(i % 2 == 0 ? i : 4096,
                                               static_cast<std::byte>(i < 3 ? 0 : 0xFF));
                                }),
            "");
}

INSTANTIATE_TEST_SUITE_P(Readers, Damage, ::testing::ValuesIn(all_readers()),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace atelier::fixtures
