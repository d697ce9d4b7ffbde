#include <algorithm>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/mesh_fbx.h"
#include "tests/hostile/readers.h"
#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

class Malformed : public ::testing::TestWithParam<MalformedFile> {};

TEST_P(Malformed, MalformedFile_IsRefusedWithTheReason) {
  const std::vector<Reader> readers = all_readers();
  const auto reader = std::find_if(readers.begin(), readers.end(), [](const Reader& candidate) {
    return candidate.name == GetParam().reader;
  });
  ASSERT_NE(reader, readers.end()) << "no fuzz/" << GetParam().reader << "_fuzz.cpp";
  try {
    reader->read(bytes_of(GetParam().path));
    FAIL() << "was read although: " << GetParam().wrong;
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr(GetParam().words));
    EXPECT_FALSE(GetParam().words.empty());
    EXPECT_FALSE(error.found.empty()) << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(
    Files, Malformed, ::testing::ValuesIn(all_malformed_files()), [](const auto& instance) {
      std::string name = instance.param.reader + "_" + instance.param.path.filename().string();
      std::replace_if(
          name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
      return name;
    });

TEST(MalformedFiles, EveryFile_IsInItsIndexOnce) {
  std::vector<std::filesystem::path> listed;
  for (const MalformedFile& file : all_malformed_files()) {
    listed.push_back(file.path);
  }
  std::sort(listed.begin(), listed.end());
  EXPECT_EQ(std::adjacent_find(listed.begin(), listed.end()), listed.end());
  std::vector<std::filesystem::path> present;
  const std::filesystem::path root = source_directory() / "tests" / "hostile" / "malformed";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    const bool left_out = entry.path().parent_path().filename() == "fbx" && !reads_fbx();
    if (entry.is_regular_file() && entry.path().filename() != "index.txt" && !left_out) {
      present.push_back(entry.path());
    }
  }
  std::sort(present.begin(), present.end());
  EXPECT_EQ(listed, present);
}

TEST(MalformedFiles, EveryReader_HasFifteen) {
  std::map<std::string, int> files;
  for (const Reader& reader : all_readers()) {
    files[reader.name] = 0;
  }
  for (const MalformedFile& file : all_malformed_files()) {
    ++files[file.reader];
  }
  for (const auto& [reader, count] : files) {
    EXPECT_GE(count, 15) << reader;
  }
}

}  // namespace
}  // namespace atelier::fixtures
