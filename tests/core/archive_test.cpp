#include "core/archive.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/support/leave.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Archive sample() {
  Archive archive;
  archive.schema = "test.sample";
  archive.version = 2;
  archive.numbers = {{"fps", 29.97}, {"tiny", 5e-324}};
  archive.texts = {{"note", "two lines\nand 100% \xC3\xA9"}, {"empty", ""}};
  archive.datasets = {
      {"vertices", tensor_of(std::vector<double>{1, 2, 3, 4, 5, 6}, {2, 3})},
      {"faces", tensor_of(std::vector<int>{0, 1, 2}, {1, 3})},
      {"nothing", Tensor{ElementType::Float32, {0, 3}, {}, {}}},
      {"group/deep/labels", tensor_of(std::vector<std::uint8_t>{7, 8})},
      {"flags", Tensor{ElementType::Bool, {2}, {std::byte{1}, std::byte{0}}, {}}},
      {"names", Tensor{ElementType::Text, {3}, {}, {"hips", "", "left \xC3\xA9"}}},
      {"big", tensor_of(std::vector<std::uint64_t>{std::numeric_limits<std::uint64_t>::max()})},
  };
  return archive;
}

void expect_equal(const Archive& a, const Archive& b) {
  EXPECT_EQ(a.schema, b.schema);
  EXPECT_EQ(a.version, b.version);
  EXPECT_EQ(a.units, b.units);
  EXPECT_EQ(a.up_axis, b.up_axis);
  EXPECT_EQ(a.numbers, b.numbers);
  EXPECT_EQ(a.texts, b.texts);
  ASSERT_EQ(a.datasets.size(), b.datasets.size());
  for (const auto& [name, tensor] : a.datasets) {
    const Tensor& other = b.datasets.at(name);
    EXPECT_EQ(tensor.type, other.type) << name;
    EXPECT_EQ(tensor.shape, other.shape) << name;
    EXPECT_EQ(tensor.data, other.data) << name;
    EXPECT_EQ(tensor.strings, other.strings) << name;
  }
}

std::vector<std::byte> bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto view = std::as_bytes(std::span(text));
  return {view.begin(), view.end()};
}

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(Archive, WrittenArchive_ReadsBackEqual) {
  const fixtures::TemporaryDirectory folder;
  write_archive(folder / "a.h5", sample());
  expect_equal(read_archive(folder / "a.h5", "test.sample", 2), sample());
  expect_equal(parse_archive(bytes_of(folder / "a.h5"), "test.sample", 2), sample());
}

TEST(Archive, MultipleChunks_ReadBackEqual) {
  const fixtures::TemporaryDirectory folder;
  std::vector<float> values(3 * 300'001);  // 3.4 MB: four chunks, the last one not full
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(i);
  }
  Archive archive;
  archive.schema = "test.large";
  archive.datasets["a"] = tensor_of(values, {300'001, 3});
  archive.datasets["wide"] = tensor_of(std::vector<double>(2 * 200'000, 0.5), {2, 1, 200'000});
  write_archive(folder / "a.h5", archive);
  expect_equal(read_archive(folder / "a.h5", "test.large", 1), archive);
}

TEST(Archive, EmptyArchive_ReadsBackEqual) {
  const fixtures::TemporaryDirectory folder;
  Archive archive;
  archive.schema = "test.empty";
  write_archive(folder / "a.h5", archive);
  expect_equal(read_archive(folder / "a.h5", "test.empty", 1), archive);
}

TEST(Archive, ManyDatasets_GrowTheUserBlock) {
  const fixtures::TemporaryDirectory folder;
  Archive archive;
  archive.schema = "test.many";
  for (int i = 0; i < 300; ++i) {
    archive.datasets["group/dataset_" + std::to_string(i)] = tensor_of(std::vector<int>{i});
  }
  write_archive(folder / "a.h5", archive);
  expect_equal(read_archive(folder / "a.h5", "test.many", 1), archive);
}

TEST(Archive, SameContent_GivesIdenticalBytes) {
  const fixtures::TemporaryDirectory folder;
  write_archive(folder / "a.h5", sample());
  write_archive(folder / "b.h5", sample());
  EXPECT_EQ(bytes_of(folder / "a.h5"), bytes_of(folder / "b.h5"));
}

TEST(Archive, WrittenFile_IsReadableByOwnerOnly) {
  const fixtures::TemporaryDirectory folder;
  write_archive(folder / "a.h5", sample());
  struct stat status {};
  ASSERT_EQ(stat((folder / "a.h5").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST(Archive, WrittenFile_OpensInPlainH5py) {
  if (std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") != 0) {
    GTEST_SKIP() << "no h5py (python3-h5py)";
  }
  const fixtures::TemporaryDirectory folder;
  write_archive(folder / "a.h5", sample());
  std::ofstream(folder / "check.py")
      << "import h5py, numpy as np\n"
      << "f = h5py.File('" << (folder / "a.h5").string() << "', 'r')\n"
      << R"(
a = f.attrs
assert (a['schema'], a['schema_version'], a['units'], a['up_axis']) == ('test.sample', 2, 'm', 'y')
assert a['fps'] == 29.97
assert a['note'] == 'two lines\nand 100% \u00e9'
assert f['vertices'].dtype == np.float64 and f['vertices'].fletcher32
assert (f['vertices'][:] == [[1, 2, 3], [4, 5, 6]]).all()
assert f['faces'].dtype == np.int32 and (f['faces'][:] == [[0, 1, 2]]).all()
assert f['nothing'].shape == (0, 3)
assert (f['group/deep/labels'][:] == [7, 8]).all()
assert f['flags'].dtype == bool and f['flags'][:].tolist() == [True, False]
assert list(f['names'].asstr()[:]) == ['hips', '', 'left \u00e9']
assert f['big'][0] == 2**64 - 1
)";
  EXPECT_EQ(std::system(("/usr/bin/python3 " + (folder / "check.py").string()).c_str()), 0);
}

TEST(Archive, ContentsOnly_AreReadWithoutData) {
  const fixtures::TemporaryDirectory folder;
  write_archive(folder / "a.h5", sample());
  const Archive contents = archive_contents(folder / "a.h5");
  EXPECT_EQ(contents.schema, "test.sample");
  EXPECT_EQ(contents.numbers, sample().numbers);
  EXPECT_EQ(contents.datasets.size(), sample().datasets.size());
  EXPECT_THAT(contents.datasets.at("vertices").shape, ElementsAre(2, 3));
  EXPECT_TRUE(contents.datasets.at("vertices").data.empty());
}

TEST(Archive, ConcurrentWriters_GiveIdenticalFiles) {
  const fixtures::TemporaryDirectory folder;
  parallel_for(16, 1, [&](Index begin, Index) {
    write_archive(folder / (std::to_string(begin) + ".h5"), sample());
  });
  for (int i = 0; i < 16; ++i) {
    EXPECT_EQ(bytes_of(folder / (std::to_string(i) + ".h5")), bytes_of(folder / "0.h5"));
  }
}

TEST(Archive, FlippedByte_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  Archive archive;
  archive.schema = "test.small";
  archive.datasets["a"] = tensor_of(std::vector<float>{1, 2, 3});
  write_archive(folder / "a.h5", archive);
  const std::vector<std::byte> good = bytes_of(folder / "a.h5");
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::vector<std::byte> bad = good;
    bad[i] ^= std::byte{0x10};
    ASSERT_NE(refusal([&] { parse_archive(bad, "test.small", 1); }), "") << "byte " << i;
  }
}

TEST(Archive, OtherSchemaOrNewerVersion_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  write_archive(folder / "a.h5", sample());
  EXPECT_THAT(refusal([&] { read_archive(folder / "a.h5", "test.other", 2); }),
              HasSubstr("test.sample; expected test.other"));
  EXPECT_THAT(refusal([&] { read_archive(folder / "a.h5", "test.sample", 1); }),
              HasSubstr("test.sample version 2; expected 1 to 1"));
}

TEST(Archive, NonArchiveFile_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / "text.h5") << "hello";
  EXPECT_THAT(refusal([&] { read_archive(folder / "text.h5", "x", 1); }),
              HasSubstr("no archive of Atelier"));
  EXPECT_THROW(read_archive(folder / "missing.h5", "x", 1), DataError);
  EXPECT_THROW(read_archive(folder.path(), "x", 1), DataError);
  EXPECT_THROW(archive_contents(folder / "text.h5"), DataError);
}

TEST(Archive, UnrepresentableContent_ThrowsLogicError) {
  const fixtures::TemporaryDirectory folder;
  const auto refuse = [&](const auto& change) {
    Archive archive = sample();
    change(archive);
    EXPECT_THROW(write_archive(folder / "a.h5", archive), LogicError);
  };
  refuse([](Archive& a) { a.schema = ""; });
  refuse([](Archive& a) { a.schema = "two words"; });
  refuse([](Archive& a) { a.version = 0; });
  refuse([](Archive& a) { a.up_axis = "up"; });
  refuse([](Archive& a) { a.numbers["nan"] = std::numeric_limits<double>::quiet_NaN(); });
  refuse([](Archive& a) { a.numbers["units"] = 1; });
  refuse([](Archive& a) { a.texts["fps"] = "30"; });
  refuse([](Archive& a) { a.texts["nul"] = std::string("a\0b", 3); });
  refuse([](Archive& a) { a.datasets["../up"] = tensor_of(std::vector<int>{1}); });
  refuse([](Archive& a) { a.datasets["/absolute"] = tensor_of(std::vector<int>{1}); });
  refuse([](Archive& a) { a.datasets["scalar"] = tensor_of(std::vector<int>{1}, {}); });
  refuse([](Archive& a) { a.datasets["half"] = Tensor{ElementType::Float16, {0}, {}, {}}; });
  refuse([](Archive& a) { a.datasets["vertices"].data.pop_back(); });
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
}

TEST(Archive, FullDisk_IsEnvironmentErrorAndKeepsOldFile) {
  // The file size limit stands for a full disk: writes beyond it fail.
  const fixtures::TemporaryDirectory folder;
  write_archive(folder / "old.h5", sample());
  const std::vector<std::byte> old = bytes_of(folder / "old.h5");
  Archive archive = sample();
  archive.datasets["bulk"] = tensor_of(std::vector<float>(30'000, 1));
  for (rlim_t limit = 0; limit <= 120'000; limit += 10'000) {
    const pid_t child = fork();
    if (child == 0) {
      signal(SIGXFSZ, SIG_IGN);
      const rlimit ceiling{limit, RLIM_INFINITY};
      setrlimit(RLIMIT_FSIZE, &ceiling);
      int code = 1;
      try {
        write_archive(folder / "old.h5", archive);
      } catch (const EnvironmentError& error) {
        code = std::string(error.what()).find("old.h5") != std::string::npos ? 0 : 2;
      }
      fixtures::leave(code);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status)) << limit;
    EXPECT_EQ(WEXITSTATUS(status), 0) << limit;
    EXPECT_EQ(bytes_of(folder / "old.h5"), old) << limit;
  }
}

TEST(Archive, MissingFolder_IsEnvironmentError) {
  const fixtures::TemporaryDirectory folder;
  EXPECT_THROW(write_archive(folder / "missing/a.h5", sample()), EnvironmentError);
}

}  // namespace
}  // namespace atelier
